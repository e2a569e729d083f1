import json
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from adapters.sumo import SumoTraffic
from adapters.sumo.entities import Dynamics, Entity, Finish, Position, Synchronise, Trigger
from adapters.sumo.errors import SumoError
from adapters.sumo.parameters import Background, Equipment
from adapters.traffic.geometry import Boxes, box_distance
from orchestrator.errors import ComponentTypeError
from orchestrator.parameters import PythonComponentType, declared
from orchestrator.randomness import stream
from orchestrator.signal import Signals
from orchestrator.testing import check_component
from tests.adapters.red_light import ALONE, STEP as H, entity, red_light

SPARSE = {"spacing": 60.0}
PARAMETERS = red_light(background=SPARSE)
TRUCKS = entity(PARAMETERS, "blocking").count
EGO, COLLIDER = 0, 1
COAST = np.zeros(3)
BRAKE = np.array([0.0, 1.0, 0.0])

Float = npt.NDArray[np.float64]
Policy = Callable[[float], Float]


def run(
    seed: int, policy: Policy, seconds: float, parameters: Any = PARAMETERS
) -> Iterator[Signals]:
    """The outputs at each communication point."""
    traffic = SumoTraffic(parameters)
    traffic.setup(0, stream(seed, "traffic"))
    try:
        yield traffic.outputs()
        for k in range(round(seconds * 1e9) // H):
            traffic.step({"ego.command": policy(k * H / 1e9)}, k * H, H)
            yield traffic.outputs()
    finally:
        traffic.close()


def array(signals: Signals, name: str) -> Float:
    return np.asarray(signals[name])


def entered(signals: Signals) -> list[tuple[int, str, str]]:
    """Number, name and type of each newcomer."""
    events = bytes(signals["entered"])
    return [tuple(each) for each in json.loads(events)] if events else []


def row_of(signals: Signals, number: int) -> int:
    return int(np.flatnonzero(array(signals, "vehicle.id") == number)[0])


def coast(_: float) -> Float:
    return COAST


def brake_from(start: float) -> Policy:
    return lambda t: BRAKE if t >= start else COAST


def gaps(signals: Signals, row: int) -> Float:
    """Distances [m] from one body to all others."""
    boxes = Boxes(
        center=array(signals, "vehicle.position")[:, :2],
        heading=array(signals, "vehicle.heading"),
        size=array(signals, "vehicle.size")[:, :2],
    )
    one = Boxes(center=boxes.center[row], heading=boxes.heading[row], size=boxes.size[row])
    return np.delete(box_distance(one, boxes), row)


def test_the_component_keeps_the_contract() -> None:
    check_component(
        SumoTraffic(PARAMETERS),
        steps=20,
        h=H,
        inputs=lambda _: {"ego.command": np.array([0.3, 0.0, 0.1])},
    )


def test_a_step_size_of_several_steps_of_sumo_gives_the_same_traffic() -> None:
    fine = list(run(3, coast, 4.0))
    newcomers = [each for signals in fine for each in entered(signals)]
    traffic = SumoTraffic(PARAMETERS)
    traffic.setup(0, stream(3, "traffic"))
    found = entered(traffic.outputs())
    for k in range(len(fine) // 4):
        traffic.step({"ego.command": COAST}, k * 4 * H, 4 * H)
        found += entered(traffic.outputs())
    for name, signal in traffic.outputs().items():
        if name not in {"ego.gap", "ego.nearest", "entered"}:  # those look back over the whole step
            np.testing.assert_array_equal(signal, fine[-1][name], err_msg=name)
    assert found == newcomers
    assert len(newcomers) > len(array(fine[0], "vehicle.id")), "somebody enters later"
    traffic.close()


@pytest.mark.parametrize("seed", range(6))
def test_without_braking_the_collider_hits_the_ego(seed: int) -> None:
    for signals in run(seed, coast, 18.0):
        if signals["ego.collision"]:
            break
    assert signals["ego.collision"]
    assert signals["ego.gap"] == 0.0
    assert signals["ego.nearest"] == COLLIDER
    assert array(signals, "ego.speed") == pytest.approx(30 / 3.6)
    ego, collider = array(signals, "ego.position"), row_of(signals, COLLIDER)
    conflict = np.array([7.0, -5.25])
    assert np.hypot(*(ego - conflict)) < 3.5
    assert np.hypot(*(array(signals, "vehicle.position")[collider, :2] - conflict)) < 3.5


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("lead", [2.0, 5.0])
def test_braking_in_time_avoids_it_and_everybody_else_gives_way(seed: int, lead: float) -> None:
    """The collision would be at 16.5 s; the collider passes, and touches nobody."""
    passed = np.inf
    for signals in run(seed, brake_from(16.5 - lead), 24.0):
        collider = row_of(signals, COLLIDER)
        passed = min(passed, float(gaps(signals, collider).min()))
    assert not signals["ego.collision"]
    assert array(signals, "ego.speed") == 0.0
    assert array(signals, "vehicle.position")[collider, 0] > 14.0
    assert passed > 0.3


@pytest.mark.slow
def test_bodies_of_the_background_never_overlap() -> None:
    parameters = red_light(background={"spacing": 25.0})
    for k, signals in enumerate(run(5, coast, 60.0, parameters)):
        if k % 10 == 0:
            others = np.flatnonzero(array(signals, "vehicle.id") > COLLIDER)
            for row in others:
                apart = gaps(signals, int(row))
                near = np.delete(array(signals, "vehicle.id"), row) > COLLIDER
                assert apart[near].min() > 0.0, f"at {k * 0.05} s"


def test_nobody_is_ahead_of_the_ego_on_its_way_and_the_trucks_stand() -> None:
    at_start: dict[int, Float] = {}
    for signals in run(1, coast, 16.0):
        position = array(signals, "vehicle.position")
        ahead = (np.abs(position[:, 0] - 7.0) < 1.75) & (position[:, 1] < 8.0)
        ahead &= position[:, 1] > array(signals, "ego.position")[1]
        assert not ahead.any()
        for number in range(2, 3 + TRUCKS):
            place = position[row_of(signals, number)]
            np.testing.assert_array_equal(place, at_start.setdefault(number, place))


def test_followers_react_to_the_ego() -> None:
    """It brakes to a standstill on the open road; those behind it stop, too."""
    parameters = red_light(background={"spacing": 20.0}, entities=ALONE)
    *_, signals = run(2, brake_from(1.0), 20.0, parameters)
    position, ego = array(signals, "vehicle.position"), array(signals, "ego.position")
    behind = (np.abs(position[:, 0] - 7.0) < 0.1) & (position[:, 1] < ego[1])
    assert behind.sum() >= 2
    nearest = position[behind, 1].max()
    assert 1.0 < ego[1] - nearest - 5.0 < 12.0
    assert not signals["ego.collision"]


def test_numbers_are_ascending_and_never_used_again() -> None:
    seen: set[int] = set()
    present: set[int] = set()
    for signals in run(4, coast, 30.0):
        numbers = array(signals, "vehicle.id").tolist()
        assert numbers == sorted(set(numbers))
        new = set(numbers) - present
        assert new.isdisjoint(seen)
        seen |= new
        present = set(numbers)
    assert len(seen) > len(present)


def test_velocity_is_how_positions_change() -> None:
    before: Signals | None = None
    for signals in run(6, coast, 10.0):
        if before is not None:
            both, old, new = np.intersect1d(
                array(before, "vehicle.id"), array(signals, "vehicle.id"), return_indices=True
            )
            moved = array(signals, "vehicle.position")[new] - array(before, "vehicle.position")[old]
            straight = np.abs(np.sin(2 * array(signals, "vehicle.heading")[new])) < 1e-6
            np.testing.assert_allclose(
                moved[straight, :2] / 0.05,
                array(signals, "vehicle.velocity")[new][straight],
                atol=0.02,  # SUMO hands out positions that it keeps as lane and distance
            )
            assert len(both) > 20
        before = signals


def test_what_does_not_change_is_the_same_object() -> None:
    previous: Signals | None = None
    for signals in run(7, coast, 2.0):
        if previous is not None:
            for name in ("building.vertex", "building.index", "building.height", "ego.size"):
                assert signals[name] is previous[name]
            same = signals["vehicle.id"] is previous["vehicle.id"]
            assert same == (signals["vehicle.size"] is previous["vehicle.size"])
        previous = signals


def test_the_background_has_the_density_asked_for() -> None:
    """Number of vehicles at the start, over ten seeds, against lane length over spacing."""
    free = 212.0 * 7 + 206.0 * 6 + 190.0 + 62.0  # NB right, SB, departing; WB; sharer's; ego's
    counts = []
    for seed in range(10):
        signals = next(run(seed, coast, 0.0, red_light(background={"spacing": 40.0})))
        counts.append(len(array(signals, "vehicle.id")) - 3 - TRUCKS)
    assert np.mean(counts) == pytest.approx(free / 40.0, rel=0.12)


def test_another_share_of_radios_leaves_the_traffic_as_it_is() -> None:
    *_, everybody = run(8, coast, 5.0)
    parameters = red_light(background=SPARSE, equipment={"all": {"radio": 0.5}})
    *_, half = run(8, coast, 5.0, parameters)
    np.testing.assert_array_equal(everybody["vehicle.position"], half["vehicle.position"])
    background = slice(3 + TRUCKS, None)
    assert array(everybody, "vehicle.equipped")[background].all()
    assert 0.2 < array(half, "vehicle.equipped")[background].mean() < 0.8


def test_lidars_are_capped() -> None:
    parameters = red_light(background=SPARSE, equipment={"all": {"lidar": 1.0, "lidar_limit": 3}})
    for signals in run(9, coast, 20.0, parameters):
        lidar = array(signals, "vehicle.lidar")
        assert lidar.sum() <= 2 + 3
    assert lidar[0], "the ego"
    assert lidar[row_of(signals, 2)], "the sharing node"


def test_roles_follow_the_vehicles_also_when_others_leave() -> None:
    """0 background, 1 ego, 2 collider, 3 sharer, 4 blocking: the order of the declarations."""
    assert list(PARAMETERS.entities) == ["ego", "collider", "sharer", "blocking"]
    role_of: dict[int, int] = {}
    for signals in run(3, coast, 25.0):
        roles, numbers = array(signals, "vehicle.role"), array(signals, "vehicle.id")
        for number, role in zip(numbers.tolist(), roles.tolist(), strict=True):
            assert role_of.setdefault(number, role) == role
    basic = [role_of.pop(number) for number in range(3 + TRUCKS)]
    assert basic == [1, 2, 3] + [4] * TRUCKS
    assert set(role_of.values()) == {0}


def test_without_the_encounter_nobody_runs_the_red_light() -> None:
    parameters = red_light(background=SPARSE, entities=ALONE)
    for signals in run(0, coast, 20.0, parameters):
        assert not signals["ego.collision"]
    assert array(signals, "ego.position")[1] > 8.0


def test_the_route_leads_from_the_ego_to_the_end_of_the_road() -> None:
    for signals in run(0, coast, 3.0):
        route = array(signals, "ego.route")
        np.testing.assert_allclose(route[0], array(signals, "ego.position"), atol=1e-6)
        np.testing.assert_allclose(route[-1], [7.0, 220.0])
        assert (np.diff(route[:, 1]) > 0.0).all()


def test_the_ego_leaves_at_the_end_of_its_route() -> None:
    at_the_line = {"ego": {"position": {"to_end": 0.0}}, **ALONE}
    parameters = red_light(background=SPARSE, entities=at_the_line)
    full_speed = np.array([1.0, 0.0, 0.0])
    signals: Signals = {}
    for signals in run(0, lambda _: full_speed, 12.0, parameters):
        if signals["ego.id"] == -1:
            break
    assert signals["ego.id"] == -1
    assert EGO not in array(signals, "vehicle.id")
    assert array(signals, "ego.route").shape == (0, 2)
    assert array(signals, "ego.position")[1] == pytest.approx(220.0, abs=4.0)


def test_a_second_simulation_in_the_process_is_refused_until_the_first_is_closed() -> None:
    first, second = SumoTraffic(PARAMETERS), SumoTraffic(PARAMETERS)
    first.setup(0, stream(0, "traffic"))
    with pytest.raises(SumoError, match="once per process, and it is running already"):
        second.setup(0, stream(0, "traffic"))
    second.close()  # was never set up: must not end the first one
    first.step({"ego.command": COAST}, 0, H)
    first.close()
    second.setup(0, stream(0, "traffic"))
    second.close()


@dataclass(frozen=True)
class Wrong:
    entity: str
    change: dict[str, Any]
    message: str


@pytest.mark.parametrize(
    "wrong",
    [
        Wrong(
            "ego",
            {"position": {"lane": "south_in_7"}},
            "`entities.ego`: `position.lane`: the scene has no lane `south_in_7`; there are",
        ),
        Wrong(
            "sharer",
            {"type": "tram"},
            "`entities.sharer`: `type`: the scene has no vehicle type `tram`; there are",
        ),
        Wrong(
            "ego",
            {"position": {"to_end": 500.0}},
            "`entities.ego`: `position.to_end` is 500 m, but before the end of `south_in_1` there "
            r"is room for at most 20\d\.\d m",
        ),
        Wrong(
            "blocking",
            {"count": 40},
            "`entities.blocking`: `count` is 40, but lane `south_in_2` has room for",
        ),
        Wrong(
            "collider",
            {"position": {"lane": "north_in_0"}},
            "`entities.collider`: the way from `north_in_0` does not cross that of `ego`; place",
        ),
        Wrong(
            "sharer",
            {"position": {"lane": "south_in_2"}},
            "`entities.blocking`: there is no room for `blocking.0` at the start; change its",
        ),
    ],
    ids=lambda wrong: f"{wrong.entity}-{next(iter(wrong.change))}",
)
def test_what_does_not_fit_the_scene_is_said(wrong: Wrong) -> None:
    traffic = SumoTraffic(red_light(background=SPARSE, entities={wrong.entity: wrong.change}))
    with pytest.raises(SumoError, match=wrong.message):
        traffic.setup(0, stream(0, "traffic"))
    traffic.close()


def test_all_wrong_parameters_are_named_at_once(tmp_path: Path) -> None:
    with pytest.raises(ComponentTypeError) as caught:
        SumoTraffic(replace(PARAMETERS, scene=tmp_path / "no.sumocfg", step_length=0.0333))
    assert f"there is no file `{tmp_path / 'no.sumocfg'}`" in str(caught.value)
    assert "SUMO counts whole milliseconds" in str(caught.value)


def test_a_scene_that_sumo_refuses_is_named(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    scene = tmp_path / "broken.sumocfg"
    scene.write_text('<configuration><input><net-file value="no.net.xml"/></input></configuration>')
    traffic = SumoTraffic(replace(PARAMETERS, scene=scene))
    with pytest.raises(SumoError, match=r"SUMO cannot load `.*broken\.sumocfg`"):
        traffic.setup(0, stream(0, "traffic"))
    assert "no.net.xml" in capfd.readouterr().err
    traffic.close()


def test_a_step_size_that_does_not_fit_is_refused() -> None:
    traffic = SumoTraffic(PARAMETERS)
    traffic.setup(0, stream(0, "traffic"))
    with pytest.raises(ValueError, match=r"is 0\.07 s, which is not a whole multiple"):
        traffic.step({"ego.command": COAST}, 0, 70_000_000)
    traffic.close()


def test_a_run_writes_nothing(capfd: pytest.CaptureFixture[str]) -> None:
    for _ in run(0, coast, 1.0):
        pass
    assert capfd.readouterr() == ("", "")


def test_parameters_are_offered_with_units_and_descriptions() -> None:
    offered = PythonComponentType(SumoTraffic).parameters
    assert offered["scene"].type is Path
    assert declared(Entity)["speed"].unit == "m/s"
    assert all(parameter.doc for parameter in offered.values())
    for record in (Background, Equipment, Entity, Position, Synchronise, Trigger, Finish, Dynamics):
        assert all(parameter.doc for parameter in declared(record).values()), record
