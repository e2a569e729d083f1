"""Scenes of others: whatever their configuration says, the run shows what SUMO simulates."""

import json
import subprocess
import sys
from collections.abc import Mapping
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from adapters.sumo import SumoTraffic
from adapters.sumo.checking import check_scene
from adapters.sumo.entities import Entity, Finish, Position, SpeedPoint, Synchronise, Vertex
from adapters.sumo.errors import SumoError
from adapters.sumo.parameters import Background, Equipment
from adapters.sumo.roadside import RoadsideUnit, check_places
from adapters.traffic.surroundings import Buildings, RoadSurface
from orchestrator.errors import ParameterError, Problem
from orchestrator.randomness import stream
from tests.adapters.scene import NET, ROUTES, SHAPES, Folder, said

H = 100_000_000
SEED = 7
STEPS = 100
ON = Position(lane="south_in_0", s=50.0)
AT = Position(x=0.0, y=0.0)

TYPES = """
<vTypeDistribution id="mix">
  <vType id="long" length="9" probability="0.5"/>
  <vType id="short" length="3" probability="0.5"/>
</vTypeDistribution>"""
CROWD = """
<flow id="f" type="mix" begin="0" end="10" period="0.9" departSpeed="random">
  <route edges="south_in north_out"/>
</flow>
<flow id="g" type="mix" begin="0" end="10" probability="0.4" departLane="random">
  <route edges="west_in east_out"/>
</flow>"""

REFERENCE = """
import json, os, sys
os.dup2(2, 1)
from adapters.sumo.headless import import_libsumo
libsumo = import_libsumo()
out, config, seed, *more = sys.argv[1:]
libsumo.start(["sumo", "-c", config, "--seed", seed, "--step-length", "0.1", *more])
seen = []
for _ in range(101):
    libsumo.simulationStep()
    of = libsumo.vehicle
    seen.append({n: [*of.getPosition(n), of.getAngle(n), of.getLength(n)] for n in of.getIDList()})
open(out, "w").write(json.dumps(seen))
"""


def scene(folder: Folder, more: str = "") -> Path:
    """Vehicles whose types, lanes and speeds SUMO draws."""
    folder.write(ROUTES, f"<routes>{TYPES}{CROWD}</routes>")
    return folder.config(routes=ROUTES, more=more)


def reference(config: Path, *more: str) -> list[dict[str, list[float]]]:
    """Who is where after each step of SUMO alone, in a process of its own."""
    out = config.parent / "reference.json"
    command = [sys.executable, "-c", REFERENCE, str(out), str(config), str(SEED), *more]
    subprocess.run(command, check=True, timeout=60, stderr=subprocess.DEVNULL)
    seen: list[dict[str, list[float]]] = json.loads(out.read_text())
    return seen


def shown(config: Path, **parameters: Any) -> list[dict[str, tuple[float, float]]]:
    """The centres of all but entities at each communication point, by the names in `entered`."""
    traffic = SumoTraffic(
        SumoTraffic.Parameters(scene=config, step_length=0.1, sumo_seed=SEED, **parameters)
    )
    names: dict[int, str] = {}
    seen = []
    try:
        traffic.setup(0, stream(1, "traffic"))
        for k in range(STEPS + 1):
            signals = traffic.outputs()
            entered = json.loads(bytes(signals["entered"]) or b"[]")
            names |= {number: name for number, name, _ in entered}
            others = np.asarray(signals["vehicle.role"]) == 0
            numbers = np.asarray(signals["vehicle.id"])[others].tolist()
            places = np.asarray(signals["vehicle.position"])[others, :2].tolist()
            seen.append({names[n]: tuple(p) for n, p in zip(numbers, places, strict=True)})
            traffic.step({}, k * H, H)
    finally:
        traffic.close()
    return seen


def shown_elsewhere(config: Path) -> list[dict[str, tuple[float, float]]]:
    """The same in a process of its own: libsumo does not forget that a scene was mesoscopic."""
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        return pool.submit(shown, config).result(timeout=60)


def second_scene(config: Path) -> str:
    """What is said when another scene follows in one process."""
    shown(config)
    try:
        shown(config)
    except SumoError as error:
        return str(error)
    return ""


def centre(x: float, y: float, angle: float, length: float) -> tuple[float, float]:
    a = np.radians(90.0 - angle)
    return x - 0.5 * length * float(np.cos(a)), y - 0.5 * length * float(np.sin(a))


def assert_same(mine: list[dict[str, tuple[float, float]]], config: Path, *more: str) -> None:
    theirs = reference(config, *more)
    for a, b in zip(mine, theirs, strict=True):
        assert a.keys() == b.keys()
        for name, pose in b.items():
            assert a[name] == pytest.approx(centre(*pose), abs=1e-9)
    assert len(theirs[-1]) > 5


@pytest.mark.parametrize(
    "more",
    [
        "",
        '<lateral-resolution value="0.4"/>',
        '<mesosim value="true"/>',
        '<scale value="2.5"/><time-to-teleport value="1"/>',
        '<step-method.ballistic value="true"/><default.action-step-length value="1"/>',
    ],
    ids=["as it is", "sublane", "mesoscopic", "scaled", "ballistic"],
)
def test_everybody_whom_sumo_has_is_shown_where_sumo_has_them(more: str, folder: Folder) -> None:
    config = scene(folder, more)
    assert_same((shown_elsewhere if "mesosim" in more else shown)(config), config)


def test_after_a_mesoscopic_scene_another_process_is_asked_for(folder: Folder) -> None:
    config = scene(folder, '<mesosim value="true"/>')
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        said = pool.submit(second_scene, config).result(timeout=60)
    assert said.startswith("SUMO has simulated a mesoscopic scene (`mesosim`) in this process")


def test_looking_at_distributions_of_types_leaves_the_random_numbers_of_sumo_alone(
    folder: Folder,
) -> None:
    """SUMO draws whenever a distribution is asked for its size; a roadside unit asks for all."""
    config = scene(folder)
    unit = Entity(type="roadside_unit", position=Position(x=30.0, y=30.0))
    assert_same(shown(config, entities={"unit": unit}), config)


def test_a_port_in_the_configuration_is_not_waited_at(folder: Folder) -> None:
    config = scene(folder, '<remote-port value="8873"/><num-clients value="2"/>')
    assert_same(shown(config), config, "--remote-port", "0")


def test_a_random_seed_in_the_configuration_does_not_overrule_that_of_the_run(
    folder: Folder,
) -> None:
    config = scene(folder, '<random value="true"/>')
    assert_same(shown(config), config, "--random", "false")


def problems_of(config: Path) -> list[Problem]:
    """What the component finds in the files of a scene."""
    parameters = SumoTraffic.Parameters(scene=config)
    found = SumoTraffic.check_files(parameters, thorough=False).problems
    return [each for each in found if isinstance(each, Problem)]


@pytest.mark.parametrize(
    ("more", "expected"),
    [
        (
            '<tripinfo-output value="a/t.xml"/>',
            "scene.sumocfg:6:1: `tripinfo-output`: the folder {}/a",
        ),
        (
            '<output-prefix value="b/"/><tripinfo-output value="t.xml"/>',
            "scene.sumocfg:6:28: `tripinfo-output`: the folder {}/b",
        ),
    ],
    ids=["folder", "folder in the prefix"],
)
def test_an_output_without_a_folder_is_found_before_sumo_starts(
    more: str, expected: str, folder: Folder
) -> None:
    problems = problems_of(scene(folder, more))
    hint = "does not exist; make it, or write NUL"
    assert said(problems) == [f"{expected.format(folder.path)} {hint}"]


def test_detectors_without_a_folder_are_found_too(folder: Folder) -> None:
    loop = '<e1Detector id="d" lane="south_in_0" pos="3" period="60" file="out/d.xml"/>'
    (problem,) = said(problems_of(folder.additional(loop).files.config))
    assert problem.startswith(f"{SHAPES}:2:1: `e1Detector file`: the folder ")


def test_outputs_with_a_folder_or_without_a_file_are_sound(folder: Folder) -> None:
    (folder.path / "a").mkdir()
    more = '<tripinfo-output value="a/t.xml"/><log value="NUL"/><summary-output value="s.xml"/>'
    assert problems_of(scene(folder, more)) == []


def test_a_mesoscopic_scene_is_remarked_and_has_no_entities(folder: Folder) -> None:
    config = scene(folder, '<mesosim value="true"/>')
    check = check_scene(config, thorough=False)
    assert not check.problems
    assert said(check.remarks)[0].startswith("scene.sumocfg:6:1: with `mesosim` SUMO has queues")
    parameters = SumoTraffic.Parameters(
        scene=config, entities={"a": Entity(type="long", position=ON)}
    )
    (problem,) = SumoTraffic.check_files(parameters, thorough=False).problems
    assert str(getattr(problem, "address", "")) == "('entities',)"


def test_an_entity_cannot_take_the_name_of_a_vehicle_or_the_type_of_a_distribution(
    folder: Folder,
) -> None:
    car = '<vehicle id="a" depart="5"><route edges="south_in north_out"/></vehicle>'
    folder.write(ROUTES, f"<routes>{TYPES}\n{car}</routes>")
    config = folder.config(routes=ROUTES)
    entities = {"a": Entity(type="long", position=ON), "b": Entity(type="mix", position=ON)}
    found = SumoTraffic.check_files(
        SumoTraffic.Parameters(scene=config, entities=entities), thorough=False
    )
    what = {getattr(each, "address", ()): each.what for each in found.problems}
    assert what[("entities", "a")].startswith("a vehicle of the scene has this name (")
    assert what[("entities", "b", "type")].startswith("the scene has no vehicle type `mix`")


@pytest.mark.parametrize("brings", ["nothing", "an entity", "background", "demand"])
def test_only_a_scene_that_nobody_is_in_is_remarked(brings: str, folder: Folder) -> None:
    car = '<vehicle id="a" depart="5"><route edges="south_in north_out"/></vehicle>'
    folder.write(ROUTES, f"<routes>{TYPES}{car if brings == 'demand' else ''}</routes>")
    means: dict[str, dict[str, Any]] = {
        "an entity": {"entities": {"a": Entity(type="long", position=ON)}},
        "background": {"background": Background()},
    }
    config = folder.config(routes=ROUTES)
    parameters = SumoTraffic.Parameters(scene=config, **means.get(brings, {}))
    found = SumoTraffic.check_files(parameters, thorough=False)
    what = "neither the scene nor `entities` or `background` bring a vehicle or a person"
    assert found.problems == ()
    assert [each.what for each in found.remarks] == [what] * (brings == "nothing")


def test_a_rule_for_types_that_the_scene_lacks_is_remarked(folder: Folder) -> None:
    rules = {"trams": Equipment(types="tram*", radio=1.0), "long": Equipment(types="lo*")}
    parameters = SumoTraffic.Parameters(scene=scene(folder), equipment=rules)
    (remark,) = SumoTraffic.check_files(parameters, thorough=False).remarks
    assert remark.what == "no vehicle type of the scene matches `tram*`: the rule has no effect"


def refused(folder: Folder, entities: Mapping[str, Entity]) -> dict[str, str]:
    """What the component refuses, by parameter, before it has read the scene."""
    with pytest.raises(ParameterError) as caught:
        SumoTraffic(SumoTraffic.Parameters(scene=scene(folder), entities=entities))
    return {".".join(map(str, each.address)): each.what for each in caught.value.problems}


def car(position: Position = ON, **more: Any) -> Entity:
    return Entity(type="long", position=position, **more)


@pytest.mark.parametrize(
    ("entity", "parameter", "what"),
    [
        (car(Position()), "position", "says no place; write `lane`, or `x` and `y`"),
        (car(Position(x=1.0)), "position", "has only one of"),
        (car(Position(lane="south_in_0", s=9.0, to_end=9.0)), "position", "both `s` and `to_end`"),
        (car(controller="policy", count=2), "count", "it is driven; declare each by its name"),
        (car(AT, controller="policy"), "position", "is for those on a lane; write `lane`"),
        (car(AT, count=2), "count", "a queue stands on a lane"),
        (car(controller="policy", parked=True), "parked", "moved by `controller: policy` and"),
        (car(finish=Finish()), "finish", "is for driven entities"),
        (car(controller="policy", finish=Finish(x=1.0)), "finish", "has only one of `x` and `y`"),
        (car(synchronise=Synchronise(entity="e")), "synchronise.entity", "is the entity itself"),
        (car(route=("a",), to="a"), "to", "both `route` and `to`"),
        (
            car(speed_profile=(SpeedPoint(time=3.0, speed=1.0), SpeedPoint(time=1.0, speed=2.0))),
            "speed_profile",
            "the times must not decrease, got [3.0, 1.0]",
        ),
        (
            car(AT, trajectory=(Vertex(time=1.0, x=0.0, y=0.0), Vertex(time=1.0, x=1.0, y=0.0))),
            "trajectory",
            "the times must increase, got [1.0, 1.0]",
        ),
        (
            car(trajectory=(Vertex(time=1.0, x=0.0, y=0.0),)),
            "position",
            "who follows a trajectory starts at `x`, `y`",
        ),
        (Entity(type="roadside_unit", position=ON), "position", "a roadside unit is on no lane"),
        (Entity(type="roadside_unit", position=AT, count=2), "count", "a roadside unit is one"),
        (
            Entity(type="roadside_unit", position=AT, controller="policy"),
            "controller",
            "nobody drives a roadside unit",
        ),
    ],
)  # fmt: skip
def test_what_cannot_be_is_refused_at_its_parameter(
    entity: Entity, parameter: str, what: str, folder: Folder
) -> None:
    found = refused(folder, {"e": entity})
    assert what in found[f"entities.e.{parameter}"]


def test_who_meets_somebody_needs_one_with_a_way(folder: Folder) -> None:
    met = {"b": car(AT), "c": car(presence=0.0)}
    meeting = {f"to_{name}": car(synchronise=Synchronise(entity=name)) for name in met}
    found = refused(folder, {**met, **meeting})
    assert "starts at `x`, `y` and has no way" in found["entities.to_b.synchronise.entity"]
    assert "never takes part" in found["entities.to_c.synchronise.entity"]


def refusal(config: Path, entities: Mapping[str, Entity]) -> str:
    """What the component says when SUMO has read the scene."""
    traffic = SumoTraffic(SumoTraffic.Parameters(scene=config, entities=entities))
    with pytest.raises(SumoError) as caught:
        traffic.setup(0, stream(1, "traffic"))
    traffic.close()
    return str(caught.value)


def test_who_begins_far_from_every_road_is_named(folder: Folder) -> None:
    what = refusal(scene(folder), {"e": car(Position(x=9e5, y=9e5))})
    assert "`entities.e`: SUMO finds no lane near (900004, 900000) m" in what


def test_a_lane_that_is_closed_to_the_class_is_named_with_those_it_is_open_to(
    folder: Folder,
) -> None:
    net = folder.path / NET
    lane = '<lane id="south_in_0" '
    net.write_text(net.read_text().replace(lane, f'{lane}allow="bus tram" ', 1))
    config = folder.config()
    what = refusal(config, {"e": Entity(type="DEFAULT_VEHTYPE", position=ON)})
    assert what == (
        "`entities.e`: `position.lane`: `south_in_0` is not for the class `passenger`, to which "
        "the type `DEFAULT_VEHTYPE` belongs; it is open to bus, tram"
    )


def test_a_name_that_sumo_has_already_names_the_entity(folder: Folder) -> None:
    vehicle = '<vehicle id="v" depart="0"><route edges="south_in north_out"/></vehicle>'
    folder.write(ROUTES, f"<routes>{TYPES}{vehicle}</routes>")
    what = refusal(folder.config(routes=ROUTES), {"v": car()})
    assert what.startswith("`entities.v`: SUMO refuses `v`: The vehicle 'v'")


def test_sumo_gives_up_in_the_middle_with_its_own_words(folder: Folder) -> None:
    vehicle = (
        '<vehicle id="v" depart="1" departLane="7"><route edges="south_in north_out"/></vehicle>'
    )
    folder.write(ROUTES, f"<routes>{vehicle}</routes>")
    parameters = SumoTraffic.Parameters(scene=folder.config(routes=ROUTES), step_length=0.1)
    traffic = SumoTraffic(parameters)
    traffic.setup(0, stream(1, "traffic"))
    for k in range(9):
        traffic.step({}, k * H, H)
    with pytest.raises(SumoError, match="SUMO gave up: Invalid departLane definition"):
        traffic.step({}, 9 * H, H)
    traffic.close()


def test_exactly_the_units_within_walls_or_on_the_road_are_refused() -> None:
    """Among thousands of squares, wherever they are; the answer is known by subtraction."""
    rng = np.random.default_rng(1)
    centres = rng.uniform(0.0, 1000.0, (400, 2))
    corners = np.array([(-5.0, -5.0), (5.0, -5.0), (5.0, 5.0), (-5.0, 5.0)])
    squares = [centre + corners for centre in centres]
    units = [
        RoadsideUnit(name=f"u{k}", x=x, y=y, antenna_height=3.0, role=k + 1)
        for k, (x, y) in enumerate(rng.uniform(-100.0, 1100.0, (300, 2)).tolist())
    ]
    walls, lanes = Buildings.of(squares[:200], [10.0] * 200), RoadSurface.of(squares[200:])
    with pytest.raises(SumoError) as caught:
        check_places(units, buildings=walls, road=lanes, tallest=4.0)
    refused = [line.split("`")[1] for line in str(caught.value).splitlines()]
    within = [np.abs(centres - (unit.x, unit.y)).max(axis=1) < 5.0 for unit in units]
    expected = [f"entities.u{k}" for k, each in enumerate(within) if each.any()]
    assert refused == expected
    assert 3 < len(expected) < 100
    assert sum("inside a building" in line for line in str(caught.value).splitlines()) == sum(
        each[:200].any() for each in within
    )
