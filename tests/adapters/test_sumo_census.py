"""Everybody that SUMO reports is signalled, where SUMO has it, and nobody else."""

import logging
import math
import re
import xml.etree.ElementTree as ET
from collections.abc import Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

import libsumo
import numpy as np
import pytest

from adapters.sumo import SumoTraffic
from adapters.sumo.census import Census
from adapters.sumo.entities import Entity, Position, SpeedPoint
from adapters.sumo.equipment import Outfitter
from adapters.sumo.parameters import Background, Equipment, Origin, TrafficParameters
from adapters.sumo.scene import VehicleType
from adapters.traffic.bodies import Body
from orchestrator.distribution import Constant
from orchestrator.randomness import stream
from tests.adapters.sumo_runs import NETS, Command, Run, car, scene, simulate

OUTPUT = '<output><fcd-output value="fcd.xml"/><precision value="9"/></output>'
"""SUMO's own record of everybody, after each of its steps."""

TOWN_DEMAND = """
    <person id="rider" depart="0" departPos="40">
        <walk edges="wm" arrivalPos="60"/>
        <ride busStop="east" lines="line"/>
        <walk edges="me" arrivalPos="120"/>
    </person>
    <person id="walker" depart="0" departPos="100">
        <walk from="wm" to="me" arrivalPos="30"/>
    </person>
    <route id="through" edges="wm me"/>
    <flow id="cars" type="car" route="through" begin="0" end="60" period="4" departSpeed="max"/>
    <flow id="plain" route="through" begin="1" end="60" period="7"/>
    <trip id="trip" depart="2" from="sm" to="mw"/>
    <vehicle id="bike" type="bike" depart="3"><route edges="em mw"/></vehicle>
    <vehicle id="tram" type="tram" depart="4"><route edges="track"/></vehicle>
    <vehicle id="walker" type="car" depart="4.5"><route edges="nm ms"/></vehicle>
    <vehicle id="bus" type="bus" line="line" depart="5">
        <route edges="wm me"/>
        <stop busStop="west" duration="25"/>
        <stop busStop="east" duration="5"/>
    </vehicle>
    <vehicle id="parks" type="car" depart="6">
        <route edges="em mn"/><stop lane="em_2" endPos="80" duration="20" parking="true"/>
    </vehicle>
"""
"""A person and a car share a name; `plain` has SUMO's built-in type."""

TOWN_EXTRA = """
    <vType id="tram" vClass="tram"/>
    <vType id="bus" vClass="bus"/>
    <busStop id="west" lane="wm_2" startPos="40" endPos="70"/>
    <busStop id="east" lane="me_2" startPos="60" endPos="90"/>
"""


@dataclass(frozen=True)
class Reported:
    """Somebody in SUMO's output: front x, y [m], degrees clockwise from north, speed [m/s]."""

    name: str
    is_person: bool
    x: float
    y: float
    angle: float
    speed: float


def reported(path: Path) -> list[list[Reported]]:
    """Those in SUMO's output, step by step; without persons who ride in the only bus."""
    steps = []
    for step in ET.parse(path).getroot():  # noqa: S314 - SUMO wrote it
        found = [
            Reported(
                name=str(e.get("id")),
                is_person=e.tag == "person",
                x=float(e.get("x", "nan")),
                y=float(e.get("y", "nan")),
                angle=float(e.get("angle", "nan")),
                speed=float(e.get("speed", "nan")),
            )
            for e in step
        ]
        bus = {(each.x, each.y) for each in found if each.name == "bus"}
        steps.append([e for e in found if not (e.is_person and (e.x, e.y) in bus)])
    return steps


def assert_complete(run: Run, path: Path) -> None:
    """The outputs have all in SUMO's record with their poses, at each communication point."""
    record = reported(path)
    assert len(record) == len(run.points)
    for k, wanted in enumerate(record):
        signals = run.points[k]
        position, size, heading, velocity = (
            np.asarray(signals[f"vehicle.{name}"])
            for name in ("position", "size", "heading", "velocity")
        )
        ahead = np.c_[np.cos(heading), np.sin(heading)]
        front = position[:, :2] + 0.5 * size[:, :1] * ahead
        ours = sorted(
            (name, x, y, math.hypot(*v))
            for name, (x, y), v in zip(run.present(k), front.tolist(), velocity, strict=True)
        )
        theirs = sorted((e.name, e.x, e.y, e.speed) for e in wanted)
        assert [each[0] for each in ours] == [each[0] for each in theirs], f"at {k}"
        np.testing.assert_allclose(
            [each[1:] for each in ours], [each[1:] for each in theirs], atol=1e-6, err_msg=f"at {k}"
        )
        angles = {(e.name, round(e.x, 4), round(e.y, 4)): e.angle for e in wanted}
        for name, (x, y), h in zip(run.present(k), front.tolist(), heading, strict=True):
            turned = math.radians(90.0 - angles[name, round(x, 4), round(y, 4)]) - h
            assert abs(math.remainder(turned, math.tau)) < 1e-6


@pytest.fixture(scope="module")
def town(tmp_path_factory: pytest.TempPathFactory) -> tuple[Run, Path]:
    """Cars, a bus, a tram, a bicycle, persons who walk and ride, and one who parks."""
    folder = tmp_path_factory.mktemp("town")
    return simulate(scene(folder, "town", TOWN_DEMAND, OUTPUT, TOWN_EXTRA), 200.0), folder


def test_everybody_in_a_town_is_there_and_where_sumo_has_them(town: tuple[Run, Path]) -> None:
    run, folder = town
    assert_complete(run, folder / "fcd.xml")


def test_bodies_and_sizes_are_those_of_sumos_classes(town: tuple[Run, Path]) -> None:
    """Of types without any parameter; heights are SUMO's defaults."""
    run, _ = town
    bodies: Mapping[str, tuple[Body, float]] = {
        "cars.0": (Body.CAR, 1.5),
        "plain.0": (Body.CAR, 1.5),
        "bike": (Body.BICYCLE, 1.7),
        "tram": (Body.RAIL, 3.2),
        "bus": (Body.BUS, 3.4),
        "rider": (Body.PEDESTRIAN, 1.719),
    }
    for name, (body, height) in bodies.items():
        k = next(k for k in range(len(run.points)) if run.row(k, name) is not None)
        row = run.row(k, name)
        assert run.array(k, "vehicle.body")[row] == body
        assert run.array(k, "vehicle.size")[row, 2] == pytest.approx(height)
        assert run.array(k, "vehicle.antenna_height")[row] == pytest.approx(height + 0.05)


def test_a_person_who_rides_is_no_body_and_another_one_afterwards(town: tuple[Run, Path]) -> None:
    run, _ = town
    numbers = [number for number, name in run.name.items() if name == "rider"]
    assert len(numbers) == 2
    there = [[n in run.array(k, "vehicle.id") for k in range(len(run.points))] for n in numbers]
    assert not any(a and b for a, b in zip(*there, strict=True))
    before, after = np.flatnonzero(there[0])[-1], np.flatnonzero(there[1])[0]
    assert after - before > 100  # at least ten seconds in the bus


def test_a_person_and_a_car_may_share_a_name(town: tuple[Run, Path]) -> None:
    run, _ = town
    both = [number for number, name in run.name.items() if name == "walker"]
    assert len(both) == 2
    k = next(k for k in range(len(run.points)) if set(both) <= set(run.array(k, "vehicle.id")))
    rows = np.isin(run.array(k, "vehicle.id"), both)
    assert sorted(run.array(k, "vehicle.body")[rows]) == [Body.CAR, Body.PEDESTRIAN]


BLOCKED = """
    <vehicle id="block" type="car" depart="0" departPos="100">
        <route edges="east_1 east_2"/><stop lane="east_1_0" endPos="110" duration="1000"/>
    </vehicle>
    <vehicle id="b" type="car" depart="0" departPos="60" departSpeed="10">
        <route edges="east_1 east_2 east_3"/>
    </vehicle>
"""


def test_one_that_sumo_teleports_is_another_one_where_it_is_put_down(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """SUMO lifts it and puts it down beyond the junction in one step: no body moves so fast."""
    options = OUTPUT + '<processing><time-to-teleport value="3"/></processing>'
    with caplog.at_level(logging.INFO):
        run = simulate(scene(tmp_path, demand=BLOCKED, options=options), 20.0)
    assert_complete(run, tmp_path / "fcd.xml")
    assert run.name == {0: "b", 1: "block", 2: "b"}
    assert "SUMO teleports vehicle `b`" in caplog.text
    for number in run.name:
        rows = [np.flatnonzero(run.array(k, "vehicle.id") == number) for k in range(201)]
        x = [run.array(k, "vehicle.position")[row[0], 0] for k, row in enumerate(rows) if len(row)]
        assert np.abs(np.diff(x)).max() < 14.0 * 0.1 + 1e-9


def test_an_entity_that_sumo_teleports_keeps_its_role_and_what_it_carries(tmp_path: Path) -> None:
    """Only its number is another one."""
    block = BLOCKED.partition('<vehicle id="b"')[0]
    options = OUTPUT + '<processing><time-to-teleport value="3"/></processing>'
    follows = car("east_1_0", 60.0, speed=Constant(8.0), radio=False, lidar=True)
    path = scene(tmp_path, demand=block, options=options)
    run = simulate(path, 20.0, {"absent": None, "b": follows})
    assert_complete(run, tmp_path / "fcd.xml")
    assert list(run.name.values()) == ["b", "block", "b"]
    for k in (0, 200):
        row = run.row(k, "b") if k else 0
        assert run.array(k, "vehicle.role")[row] == 2
        assert not run.array(k, "vehicle.equipped")[row]
        assert run.array(k, "vehicle.lidar")[row]


def test_entities_that_are_moved_from_outside_are_not_teleported_however_long_they_stand(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    still = (SpeedPoint(time=0.0, speed=0.0),)
    entities = {
        "ego": car("east_1_0", 60.0, controller="policy"),
        "keeps": car("north_1_0", 60.0, speed_profile=still),
        "van": Entity(type="van", position=Position(x=-50.0, y=-1.6)),
    }
    options = '<processing><time-to-teleport value="3"/></processing>'
    with caplog.at_level(logging.INFO):
        run = simulate(scene(tmp_path, options=options), 20.0, entities)
    assert "SUMO teleports nobody in this run" in caplog.text
    assert run.name == {0: "ego", 1: "keeps", 2: "van"}
    np.testing.assert_array_equal(run.array(0, "vehicle.id"), run.array(200, "vehicle.id"))
    first, last = run.array(0, "vehicle.position"), run.array(200, "vehicle.position")
    np.testing.assert_allclose(first, last, atol=1e-9)


def test_one_that_takes_over_a_name_is_another_one(tmp_path: Path) -> None:
    """Later, or in the very next step: numbers are never used again."""

    def demand(t: float) -> Mapping[str, Command]:
        match round(t * 10):
            case 10:
                libsumo.route.add("r", ["east_1", "east_2"])
                libsumo.vehicle.add("x", "r", departPos="50", departSpeed="5")
            case 20:
                libsumo.vehicle.remove("x")
                libsumo.vehicle.add("x", "r", departPos="20", departSpeed="5")
            case 30:
                libsumo.vehicle.remove("x")
            case 31:
                libsumo.vehicle.add("x", "r", departPos="20", departSpeed="5")
        return {}

    run = simulate(scene(tmp_path, options=OUTPUT), 4.0, policy=demand)
    numbers = [run.array(k, "vehicle.id").tolist() for k in range(41)]
    assert numbers == [[]] * 11 + [[0]] * 10 + [[1]] * 10 + [[]] + [[2]] * 9
    assert_complete(run, tmp_path / "fcd.xml")


def test_who_comes_and_goes_between_two_communication_points_is_named(tmp_path: Path) -> None:
    """At a step size of 2 s, with SUMO's step of 0.1 s."""
    demand = """<vehicle id="brief" type="car" depart="0.5" departPos="100" departSpeed="max"
        arrivalPos="110"><route edges="east_1"/></vehicle>"""
    run = simulate(scene(tmp_path, demand=demand), 4.0, h=2_000_000_000, step_length=0.1)
    assert run.name == {0: "brief"}
    assert [len(run.array(k, "vehicle.id")) for k in range(3)] == [0, 0, 0]


def test_a_scene_without_anybody_runs(tmp_path: Path) -> None:
    run = simulate(scene(tmp_path, options=OUTPUT), 2.0)
    assert_complete(run, tmp_path / "fcd.xml")
    last = run.points[-1]
    assert all(len(last[name]) == 0 for name in last if name.startswith("vehicle."))
    assert last["entered"] == b""
    assert run.array(20, "light.state").shape == (0,)


def test_lanes_without_a_length_are_roads_like_others(tmp_path: Path) -> None:
    """Netconvert leaves such lanes where an importer cut an edge short."""
    net = (NETS / "street.net.xml").read_text()
    net, count = re.subn(
        r'length="142\.80" shape="201\.60,7\.20 201\.60,150\.00"',
        'length="0.10" shape="201.60,7.20 201.60,7.20"',
        net,
    )
    assert count == 1
    (tmp_path / "short.net.xml").write_text(net)
    share = '<vType id="any"><param key="share" value="1"/></vType>'
    path = scene(tmp_path, str(tmp_path / "short"), extra=share)
    ego = car("east_1_0", 150.0, speed=Constant(10.0), controller="policy", to="branch")
    background = Background(turning_share=0.9)
    run = simulate(path, 40.0, {"ego": ego}, background=background)
    assert all(np.isfinite(run.array(0, f"road.{name}")).all() for name in ("vertex", "index"))
    assert run.array(0, "ego.route")[-1] == pytest.approx((201.6, 7.2))
    assert run.array(-1, "ego.id") == -1
    assert len(run.number) > 20


FOREIGN = """
    <vehicle id="a" type="car" depart="57600"><route edges="east_1 east_2 branch"/></vehicle>
    <vehicle id="parked" type="car" depart="57600" departPos="100">
        <route edges="east_1"/><stop lane="east_1_0" endPos="110" parking="true" duration="100"/>
    </vehicle>
"""


@pytest.mark.parametrize(
    ("net", "origin", "side"),
    [("street", (0.0, 0.0), -1.0), ("street_left", (0.0, 0.0), 1.0),
     ("street_far", (400_000.0, -400_000.0), -1.0)],
)  # fmt: skip
def test_nets_may_be_left_handed_and_far_away_and_begin_in_the_afternoon(
    tmp_path: Path,
    net: str,
    origin: tuple[float, float],
    side: float,
    caplog: pytest.LogCaptureFixture,
) -> None:
    """Cars drive 1.6 m beside the middle line, and park one lane farther out."""
    options = OUTPUT + '<time><begin value="57600"/></time>'
    with caplog.at_level(logging.INFO):
        run = simulate(scene(tmp_path, net, FOREIGN, options), 50.0, origin=Origin(x=0.0, y=0.0))
    assert_complete(run, tmp_path / "fcd.xml")
    assert "SUMO begins at 57600 s, the scenario at 0 s" in caplog.text
    x, y = origin
    assert run.of("a", "position")[0] == pytest.approx((x - 197.4, y + side * 1.6, 0.0))
    assert run.of("parked", "position")[100, 1] == pytest.approx(y + side * 4.8)
    assert run.of("a", "heading")[0] == 0.0
    assert np.isnan(run.of("a", "heading")[-1])  # it left at the dead end of `branch`
    road = run.array(0, "road.vertex")
    assert road.min(axis=0) == pytest.approx((x - 200.0, y - 200.0), abs=4.0)
    assert road.max(axis=0) == pytest.approx((x + 400.0, y + 200.0), abs=4.0)


def test_entities_are_placed_on_foreign_nets_alike(tmp_path: Path) -> None:
    places = []
    for net, x, y in (("street", 0.0, 0.0), ("street_far", 400_000.0, -400_000.0)):
        entities = {
            "ego": car("west_1_0", 50.0, controller="policy"),
            "queue": car("east_1_0", 90.0, count=3),
        }
        run = simulate(scene(tmp_path, net), 3.0, entities, origin=Origin(x=x, y=y))
        places.append(run.array(30, "vehicle.position")[:, :2])
    np.testing.assert_allclose(places[0], places[1], atol=1e-6)


def test_a_far_net_is_counted_from_its_corner(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """The corner is at (399,800 m, -400,200 m), rounded down to whole kilometres."""
    begin = '<time><begin value="57600"/></time>'
    config = scene(tmp_path, "street_far", FOREIGN, begin, HOUSES)
    with caplog.at_level(logging.INFO):
        counted = simulate(config, 5.0)
    absolute = simulate(config, 5.0, origin=Origin(x=0.0, y=0.0))
    assert "positions are relative to (399000, -401000) m of the net" in caplog.text
    for name in ("vehicle.position", "road.vertex", "building.vertex"):
        apart = absolute.array(30, name) - counted.array(30, name)
        assert len(apart)
        np.testing.assert_allclose(apart[:, :2] - (399_000.0, -401_000.0), 0.0, atol=1e-6)


HOUSES = """
    <poly id="a" type="building" shape="0,10 10,10 10,20 0,20">
        <param key="height" value="7"/>
    </poly>
    <poly id="b" type="building.yes" shape="20,10 30,10 30,20 20,10"/>
    <poly id="c" type="landuse.grass" shape="0,50 10,50 10,60"/>
    <poly id="d" type="landuse.grass" shape="0,50 10,50 10,60"/>
    <poly id="e" type="water" shape="0,50 10,50"/>
    <poly id="f" shape="0,50 10,50 10,60"/>
    <poly id="g" type="buildings" shape="0,50 10,50 10,60"/>
"""


def test_buildings_are_those_whose_type_says_so_and_the_others_are_told(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    with caplog.at_level(logging.INFO):
        run = simulate(scene(tmp_path, extra=HOUSES), 0.0, building_height=12.5)
    assert run.array(0, "building.height").tolist() == [7.0, 12.5]
    assert run.array(0, "building.index").tolist() == [0, 0, 0, 0, 1, 1, 1]
    for kind, count in (("landuse.grass", 2), ("water", 1), ("", 1), ("buildings", 1)):
        assert f"{count} polygons of type `{kind}` are no buildings" in caplog.text


def test_buildings_without_an_area_are_left_out_and_said(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    extra = """
        <poly id="line" type="building" shape="0,10 10,10 20,10"/>
        <poly id="point" type="building.yes" shape="5,5 5,5"/>
        <poly id="low" type="building" shape="0,0 9,0 9,9"><param key="height" value="-3"/></poly>
    """
    with caplog.at_level(logging.INFO):
        run = simulate(scene(tmp_path, extra=extra), 0.0, building_height=12.5)
    assert run.array(0, "building.height").tolist() == [12.5]
    assert len(run.array(0, "building.vertex")) == 3
    for text in (
        "building `line` encloses no area, it is left out",
        "building `point` encloses no area, it is left out",
        "building `low` has no height [m]: `-3`, the default holds",
    ):
        assert text in caplog.messages


class Told:
    """In place of SUMO: it reports vehicles by name, each at its place along a road [m]."""

    def __init__(self) -> None:
        self.there: tuple[str, ...] = ()
        self.entering: frozenset[str] = frozenset()

    def vehicles(self) -> Sequence[str]:
        return self.there

    def persons(self) -> list[str]:
        return []

    def departed(self) -> frozenset[str]:
        return self.entering

    def lifted(self) -> frozenset[str]:
        return frozenset()

    def type_of(self, vehicle: str) -> str:
        return "car"

    def vehicle_poses(self, names: Sequence[str]) -> np.ndarray:
        return np.array([[float(ord(name)), 0.0, 90.0, 8.0] for name in names]).reshape(-1, 4)


def test_who_is_on_its_way_out_is_gone_at_once_and_its_lidar_is_free() -> None:
    """Whatever SUMO says: it may report a vehicle once more after it was withdrawn."""
    kind = VehicleType(
        name="car",
        size=(5.0, 1.8, 1.5),
        antenna_height=1.6,
        body=Body.CAR,
        share=1.0,
        stop_gap=1.0,
    )
    sumo = Told()
    outfitter = Outfitter({"one": Equipment(lidar=1.0, lidar_limit=1)}, np.random.default_rng(1))
    census = Census(sumo, {"car": kind}, outfitter)  # type: ignore[arg-type]

    def took(there: str, entering: str, leaving: str = "") -> tuple[list[str], list[str]]:
        sumo.there, sumo.entering = tuple(there), frozenset(entering)
        change = census.take({}, frozenset(leaving))
        assert census.poses.center[:, 0].tolist() == [ord(n) - 2.5 for n in census.roster.names]
        return [vehicle.name for vehicle in change.entered], sorted(change.left)

    assert took("ab", "ab") == (["a", "b"], [])
    assert census.roster.lidar.tolist() == [True, False]
    assert took("ab", "", leaving="a") == ([], ["a"])
    assert took("bc", "c") == (["c"], [])
    assert census.roster.names == ("b", "c")
    assert census.roster.number.tolist() == [1, 2]
    assert census.roster.lidar.tolist() == [False, True]
    assert took("bc", "") == ([], [])


def test_a_run_says_where_it_counts_from(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    """Positions from a point that is far in one direction only, times after SUMO's begin."""
    config = scene(tmp_path, demand=FOREIGN)
    parameters = TrafficParameters(scene=config, step_length=0.1, origin=Origin(x=1000.0, y=0.0))
    with caplog.at_level(logging.INFO), closing(SumoTraffic(parameters)) as traffic:
        traffic.setup(1_000_000_000, stream(1, "traffic"))
    assert "positions are relative to (1000, 0) m of the net" in caplog.text
    assert "SUMO begins at 0 s, the scenario at 1 s" in caplog.text


def test_nobody_can_change_what_is_signalled(tmp_path: Path) -> None:
    """What did not change is the same array as at the communication point before."""
    run = simulate(scene(tmp_path, demand=FOREIGN), 0.2)
    for signals in run.points:
        arrays = [each for each in signals.values() if isinstance(each, np.ndarray)]
        assert arrays
        assert not any(array.flags.writeable for array in arrays)
