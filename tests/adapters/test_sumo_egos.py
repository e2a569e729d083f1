"""Several driven entities: each has its own command, outcome and distances."""

import math
from pathlib import Path

import numpy as np
import pytest

from adapters.sumo.entities import Dynamics, Entity, Finish, Position, SpeedPoint, Synchronise
from orchestrator.distribution import Constant
from tests.adapters.sumo_runs import (
    BRAKE,
    COAST,
    Command,
    Run,
    car,
    nobody_drives,
    scene,
    simulate,
)

FINE = 50_000_000
OWN = (
    "position",
    "heading",
    "speed",
    "size",
    "gap",
    "collision",
    "collision_time",
    "completion_time",
)
"""Signals of an ego that name nobody by number."""


def driven(lane: str, s: float, speed: float = 8.0, **more: object) -> Entity:
    return car(lane, s, speed=Constant(speed), controller="policy", **more)


THREE = {
    "front": driven("east_1_0", 85.0),
    "rear": driven("east_1_0", 60.0),
    "other": driven("west_2_0", 50.0),
}


def to_each(_: float) -> dict[str, Command]:
    return {"front": BRAKE, "rear": COAST, "other": (1.0, 0.0, 0.0)}


def test_each_command_reaches_the_one_it_is_for(tmp_path: Path) -> None:
    """One brakes at 8 m/s^2, one rolls, one accelerates at 3 m/s^2; all lag by 0.1 s."""
    run = simulate(scene(tmp_path), 2.0, THREE, policy=to_each)
    lag = 0.1 * -math.expm1(-2.0 / 0.1)
    assert run.series("front.speed")[-1] == 0.0
    assert set(run.series("rear.speed")) == {8.0}
    assert run.series("other.speed")[-1] == pytest.approx(8.0 + 3.0 * (2.0 - lag))
    assert {name: run.array(0, f"{name}.id") for name in THREE} == run.number


def test_the_order_of_declaration_decides_numbers_and_nothing_else(tmp_path: Path) -> None:
    run = simulate(scene(tmp_path), 6.0, THREE, policy=to_each)
    turned = simulate(scene(tmp_path), 6.0, dict(reversed(THREE.items())), policy=to_each)
    assert run.number == {"front": 0, "rear": 1, "other": 2}
    assert turned.number == {"front": 2, "rear": 1, "other": 0}
    for name in THREE:
        for signal in OWN:
            one, two = run.series(f"{name}.{signal}"), turned.series(f"{name}.{signal}")
            np.testing.assert_array_equal(one, two, err_msg=f"{name}.{signal}")
        for of in ("nearest", "collision_partner"):
            one, two = run.series(f"{name}.{of}"), turned.series(f"{name}.{of}")
            assert [run.name.get(n) for n in one] == [turned.name.get(n) for n in two]


def test_two_egos_that_collide_are_each_others_partners(tmp_path: Path) -> None:
    """The one behind covers 20 m, plus the way of the one in front until it stands, at 8 m/s."""
    run = simulate(scene(tmp_path), 6.0, THREE, policy=to_each)
    stops_after = float(run.series("front.position")[-1, 0] - run.series("front.position")[0, 0])
    meets = (20.0 + stops_after) / 8.0
    for name, partner in (("front", "rear"), ("rear", "front")):
        assert run.series(f"{name}.collision")[-1]
        assert run.series(f"{name}.collision_partner")[-1] == run.number[partner]
        at = float(run.series(f"{name}.collision_time")[-1])
        assert meets <= at <= meets + 0.01 + 1e-9  # `collision_step`
    assert not run.series("other.collision").any()
    np.testing.assert_array_equal(run.series("front.gap"), run.series("rear.gap"))
    assert not run.series("encounter.over").any()


def test_an_ego_that_is_not_there_moves_nobody(tmp_path: Path) -> None:
    """Neither before it enters nor after it left: who stands, stands."""
    entities = {
        "leaves": driven("branch_0", 135.0),
        "later": driven("west_2_0", 60.0, enters=1.0),
        "stands": car("east_1_0", 60.0, speed_profile=(SpeedPoint(time=0.0, speed=0.0),)),
    }
    run = simulate(scene(tmp_path), 3.0, entities)
    assert -1 in run.series("leaves.id")
    assert -1 in run.series("later.id")
    assert len(np.unique(run.of("stands", "position"), axis=0)) == 1


def test_the_gap_is_that_of_each_step_and_grows_behind_what_is_passed(tmp_path: Path) -> None:
    """A person stands 2 m beside the way; from then on everything is as far as the way."""
    on_foot = Entity(type="DEFAULT_PEDTYPE", position=Position(x=-143.0, y=-5.0))
    run = simulate(scene(tmp_path), 5.0, {"a": driven("east_1_0", 30.0), "stands": on_foot})
    gap, x = run.series("a.gap"), run.series("a.position")[:, 0]
    beside = int(gap.argmin())
    assert gap[beside] == pytest.approx(5.0 - 1.6 - 0.9 - 0.24, abs=0.05)
    assert x[beside - 1] - 2.5 < -143.0 < x[beside] + 2.5
    behind = x > -143.0 + 2.5 + 1.0
    rear = x[:-1][behind[1:]] - 2.5 + 143.0 - 0.11  # at the begin of the step it is nearest
    assert np.hypot(rear, gap[beside]) == pytest.approx(gap[behind], abs=0.1)
    assert gap[-1] > 5.0


@pytest.mark.parametrize("enters", [0.0, 1.0])
def test_an_ego_that_enters_where_somebody_stands_collides_at_that_time(
    tmp_path: Path, enters: float
) -> None:
    """At the communication point at which it is there first, not a step before or after it."""
    on_foot = Entity(type="DEFAULT_PEDTYPE", position=Position(x=-143.0, y=-1.6), enters=enters)
    entities = {"a": driven("east_1_0", 60.0, enters=enters), "stands": on_foot}
    run = simulate(scene(tmp_path), enters + 0.2, entities)
    first = int(np.flatnonzero(run.series("a.id") != -1)[0])
    assert first * 0.1 == pytest.approx(enters, abs=0.1 + 1e-9)
    assert not run.series("a.collision")[:first].any()
    assert run.series("a.collision_time")[first:] == pytest.approx(first * 0.1, abs=1e-9)
    assert set(run.series("a.collision_partner")[first:]) == {run.number["stands"]}
    assert run.series("a.gap")[first] == 0.0


@pytest.mark.parametrize(("pedals", "steering"), [(0.0, 0.0), (0.5, 0.0), (0.0, 1.0), (0.3, 0.7)])
def test_pedals_and_steering_answer_after_their_own_dead_times(
    tmp_path: Path, pedals: float, steering: float
) -> None:
    """To a command that holds from the start on; speed and heading are constant until then."""
    dynamics = Dynamics(pedal_delay=pedals, steering_delay=steering)
    entities = {"a": driven("east_1_0", 60.0, dynamics=dynamics)}
    run = simulate(scene(tmp_path), 2.0, entities, policy=lambda _: {"a": (0.0, 1.0, 0.3)}, h=FINE)
    for signal, delay in (("speed", pedals), ("heading", steering)):
        values = run.series(f"a.{signal}")
        differs = np.flatnonzero(values != values[0])
        assert differs[0] == round(delay * 1e9 / FINE) + 1


def test_the_encounter_is_over_when_it_is_for_all(tmp_path: Path) -> None:
    """One finishes on its way, one at the end of its route."""
    finish = Finish(x=201.6, y=100.0, distance=5.0)
    entities = {
        "a": driven("branch_0", 100.0),
        "b": driven("branch_0", 60.0, finish=finish),
    }
    run = simulate(scene(tmp_path), 12.0, entities)
    done = {name: float(run.series(f"{name}.completion_time")[-1]) for name in entities}
    # the lane begins at y = 7.2 m; rear bumpers at 55 m of it
    assert done["b"] == pytest.approx((105.0 - 7.2 - 55.0) / 8.0, abs=0.01 + 1e-9)
    assert done["a"] == pytest.approx(42.8 / 8.0, abs=0.1)
    # completion is noticed at instants of 10 ms, `collision_step`
    assert done["b"] * 100.0 == pytest.approx(round(done["b"] * 100.0), abs=1e-6)
    over = int(np.flatnonzero(run.series("encounter.over"))[0])
    assert over == math.ceil(max(done.values()) / 0.1 - 1e-6)
    assert run.array(over, "a.id") == -1
    assert run.array(over, "b.id") == run.number["b"]


def test_without_an_ego_it_is_never_over(tmp_path: Path) -> None:
    entities = {"a": car("branch_0", 140.0, speed=Constant(8.0))}
    assert not simulate(scene(tmp_path), 3.0, entities).series("encounter.over").any()


@pytest.mark.parametrize("absence", [{"presence": 0.0}, {"count": 0}])
def test_an_ego_that_does_not_take_part_is_nobody(
    tmp_path: Path, absence: dict[str, float]
) -> None:
    """Its connectors are there, as the system is wired before anybody is drawn."""
    entities = {"there": driven("west_2_0", 60.0), "absent": driven("east_1_0", 60.0, **absence)}
    run = simulate(scene(tmp_path), 1.0, entities)
    alone = simulate(scene(tmp_path), 1.0, {"there": entities["there"]})
    assert set(run.series("absent.id")) == {-1}
    assert set(run.series("absent.gap")) == {1000.0}
    assert run.array(0, "absent.route").shape == (0, 2)
    for name in alone.points[0]:
        np.testing.assert_array_equal(run.points[-1][name], alone.points[-1][name], err_msg=name)


def test_an_ego_out_of_sight_changes_nothing_for_another(tmp_path: Path) -> None:
    """Everything of `a` but whom it is near to is the same, byte for byte."""
    entities = {"a": driven("east_1_0", 60.0), "b": driven("west_1_0", 60.0)}
    both = simulate(scene(tmp_path), 5.0, entities)
    alone = simulate(scene(tmp_path), 5.0, {"a": entities["a"]})
    for signal in set(OWN) - {"gap"}:
        np.testing.assert_array_equal(both.series(f"a.{signal}"), alone.series(f"a.{signal}"))


@pytest.mark.parametrize(
    ("lane", "s", "place"),
    [
        ("north_1_0", 100.0, {}),
        ("north_1_0", 100.0, {"x": 1.6, "y": -1.6}),
        ("east_1_0", 20.0, {"x": -60.0, "y": -1.6}),
        ("west_2_0", 150.0, {"x": -60.0, "y": 1.6}),
    ],
    ids=["where ways cross", "the same place", "on one lane", "on the oncoming lane"],
)
def test_a_synchronised_vehicle_is_at_the_place_when_the_other_one_is(
    tmp_path: Path, lane: str, s: float, place: dict[str, float]
) -> None:
    """Both at a constant speed at the end: within 0.3 s of each other, 5 m before the place."""
    meeting = Synchronise(entity="ego", hold_distance=5.0, **place)
    entities = {
        "ego": driven("east_1_0", 80.0),
        "b": car(lane, s, speed=Constant(9.0), synchronise=meeting),
    }
    run = simulate(scene(tmp_path), 16.0, entities)
    x, y = place.get("x", 1.6), place.get("y", -1.6)
    there = {
        name: int(np.nanargmin(np.hypot(*(run.of(name, "position")[:, :2] - (x, y)).T)))
        for name in entities
    }
    assert there["ego"] == pytest.approx((x - -122.5) / 0.8, abs=1.0)
    assert abs(there["ego"] - there["b"]) <= 3


def swerve(t: float, *, wheel: float = 0.2) -> dict[str, Command]:
    """Onto the lane to the left and straight on; brakes from 4 s on."""
    turns_back = 3.0 + wheel * 0.6 / 0.8  # the wheel takes that long to turn
    steer = wheel if 1.0 <= t < 2.0 else -wheel if 2.0 <= t < turns_back else 0.0
    return {"ego": (0.0, float(t > 4.0), steer)}


def oncoming(tmp_path: Path, shown: str) -> Run:
    entities = {
        "ego": driven("east_1_0", 20.0, shown=shown),
        "oncoming": car("west_3_0", 10.0, speed=Constant(8.0)),
    }
    return simulate(scene(tmp_path), 14.0, entities, policy=swerve, h=FINE)


def test_oncoming_traffic_brakes_for_an_ego_that_is_shown_exactly(tmp_path: Path) -> None:
    """It stands on the oncoming lane, 1.5 m from its middle line."""
    run = oncoming(tmp_path, "exactly")
    assert run.series("ego.position")[-1, 1] > 1.0
    assert not run.series("ego.collision").any()
    assert math.hypot(*run.of("oncoming", "velocity")[-1]) < 0.5
    assert 2.5 < run.series("ego.gap")[-1] < 10.0


def test_oncoming_traffic_does_not_see_an_ego_that_is_shown_on_its_route(tmp_path: Path) -> None:
    run = oncoming(tmp_path, "route")
    assert run.series("ego.collision_partner")[-1] == run.number["oncoming"]
    speeds = np.hypot(*run.of("oncoming", "velocity").T)
    assert np.nanmin(speeds[200:]) == pytest.approx(14.0)


@pytest.mark.parametrize("shown", ["route", "exactly"])
def test_followers_brake_for_an_ego_however_it_is_shown(tmp_path: Path, shown: str) -> None:
    entities = {
        "ego": driven("east_1_0", 60.0, shown=shown),
        "follows": car("east_1_0", 30.0, speed=Constant(8.0)),
    }
    run = simulate(scene(tmp_path), 12.0, entities, policy=lambda _: {"ego": BRAKE})
    assert run.series("ego.gap")[-1] == pytest.approx(2.5, abs=0.05)  # `minGap`
    assert not run.series("ego.collision").any()


@pytest.mark.parametrize("shown", ["route", "exactly"])
def test_an_ego_off_the_road_stays_where_it_drove(tmp_path: Path, shown: str) -> None:
    """SUMO keeps it as long as it is moved at every step; its followers see what `shown` says."""
    entities = {"ego": driven("east_1_0", 60.0, shown=shown)}
    run = simulate(
        scene(tmp_path), 8.0, entities, policy=lambda t: {"ego": (0.0, 0.0, -0.5 * (t < 0.8))}
    )
    position = run.series("ego.position")
    assert position[-1, 1] < -40.0
    np.testing.assert_array_equal(run.of("ego", "position")[:, :2], position)
    assert set(run.series("ego.id")) == {run.number["ego"]}


def test_a_run_without_commands_coasts(tmp_path: Path) -> None:
    run = simulate(scene(tmp_path), 1.0, THREE, policy=nobody_drives)
    assert {run.series(f"{name}.speed")[-1] for name in THREE} == {8.0}
