"""Speed profiles, trajectories and their triggers are kept to SUMO's step."""

import math
from pathlib import Path

import numpy as np
import pytest

from adapters.sumo.entities import Entity, Position, SpeedPoint, Trigger, Vertex
from adapters.traffic.bodies import Body
from orchestrator.distribution import Constant
from tests.adapters.sumo_runs import Float, Run, car, scene, simulate

STEP = 0.1
PEDESTRIAN = "DEFAULT_PEDTYPE"

CORNERS = (
    Vertex(time=1.0, x=-20.0, y=-1.6),
    Vertex(time=3.0, x=10.0, y=-1.6),
    Vertex(time=4.0, x=10.0, y=-1.6),  # waits
    Vertex(time=5.0, x=10.0, y=10.0),
)
PROFILE = (
    SpeedPoint(time=0.0, speed=6.0),
    SpeedPoint(time=2.0, speed=20.0),  # the limit is 14 m/s
    SpeedPoint(time=4.0, speed=0.0),
)


def times(run: Run) -> Float:
    return np.linspace(0.0, STEP * (len(run.points) - 1), len(run.points))


@pytest.mark.parametrize("after", [0.0, 1.0])
def test_a_speed_profile_is_kept_whatever_stands_in_the_way(tmp_path: Path, after: float) -> None:
    """Through a car that stands on the lane; before it begins, the speed at the start."""
    entities = {
        "a": car(
            "east_1_0",
            50.0,
            speed=Constant(6.0),
            speed_profile=PROFILE,
            trigger=Trigger(after=after),
        ),
        "stands": car("east_1_0", 90.0, speed_profile=(SpeedPoint(time=0.0, speed=0.0),)),
    }
    run = simulate(scene(tmp_path), 6.0, entities)
    speed = np.interp(times(run) - after, [0.0, 2.0, 4.0], [6.0, 20.0, 0.0])
    x = run.of("a", "position")[:, 0]
    np.testing.assert_allclose(run.of("a", "velocity")[:, 0], speed, atol=1e-9)
    np.testing.assert_allclose(np.diff(x), speed[1:] * STEP, atol=1e-9)  # SUMO's Euler steps
    assert x[0] < run.of("stands", "position")[0, 0] < x[-1]
    assert len(np.unique(run.of("stands", "position")[:, 0])) == 1


def test_a_profile_without_a_speed_at_its_beginning_starts_from_the_present_one(
    tmp_path: Path,
) -> None:
    profile = (SpeedPoint(time=2.0, speed=10.0),)
    entity = car("east_1_0", 50.0, speed=Constant(6.0), speed_profile=profile)
    run = simulate(scene(tmp_path), 4.0, {"a": entity})
    expected = np.interp(times(run), [0.0, 2.0], [6.0, 10.0])
    np.testing.assert_allclose(run.of("a", "velocity")[:, 0], expected, atol=1e-9)


@pytest.mark.parametrize("kind", ["van", PEDESTRIAN, "bike"])
@pytest.mark.parametrize("after", [0.0, 1.0])
def test_a_trajectory_is_exact_at_every_communication_point(
    tmp_path: Path, kind: str, after: float
) -> None:
    """Evenly from point to point; it waits at the first one, and stays at the last."""
    start = Position(x=-40.0, y=-1.6, h=0.3)
    entity = Entity(type=kind, position=start, trajectory=CORNERS, trigger=Trigger(after=after))
    run = simulate(scene(tmp_path), 8.0, {"a": entity})
    t = times(run) - after
    at = [0.0, 1.0, 3.0, 4.0, 5.0]
    x = np.interp(t, at, [-40.0, -20.0, 10.0, 10.0, 10.0])
    y = np.interp(t, at, [-1.6, -1.6, -1.6, -1.6, 10.0])
    np.testing.assert_allclose(run.of("a", "position")[:, :2], np.c_[x, y], atol=1e-9)
    piece = np.searchsorted(np.array(at) + 1e-9, t, side="left")  # the one that it ended on
    velocity = np.array([(0, 0), (20, 0), (15, 0), (0, 0), (0, 11.6), (0, 0)])[piece]
    np.testing.assert_allclose(run.of("a", "velocity"), velocity, atol=1e-9)
    heading = np.array([0.3, 0.0, 0.0, 0.0, math.pi / 2, math.pi / 2])[piece]
    np.testing.assert_allclose(run.of("a", "heading"), heading, atol=1e-9)


def test_a_trajectory_may_begin_elsewhere_than_its_position(tmp_path: Path) -> None:
    """A vertex at time 0 is where it stands until then."""
    points = (Vertex(time=0.0, x=-30.0, y=5.0), Vertex(time=1.0, x=-30.0, y=10.0))
    entity = Entity(type="van", position=Position(x=-40.0, y=-8.0), trajectory=points)
    run = simulate(scene(tmp_path), 1.0, {"a": entity})
    np.testing.assert_allclose(run.of("a", "position")[0], (-30.0, 5.0, 0.0))


CROSSES = Entity(
    type=PEDESTRIAN,
    position=Position(x=-50.0, y=6.0),
    trajectory=(Vertex(time=4.0, x=-50.0, y=-6.0),),
    trigger=Trigger(entity="ego", closer_than=40.0),
)


def test_an_action_begins_when_somebody_is_close_enough(tmp_path: Path) -> None:
    """The step in which the distance at its beginning is within the bound is the first one."""
    entities = {
        "ego": car("east_1_0", 100.0, speed=Constant(10.0), controller="policy"),
        "foot": CROSSES,
        "waits": car(
            "west_3_0",
            20.0,
            speed_profile=(SpeedPoint(time=0.0, speed=2.0),),
            trigger=Trigger(entity="foot", closer_than=60.0, after=0.5),
        ),
    }
    run = simulate(scene(tmp_path), 4.0, entities)
    foot, ego = run.of("foot", "position")[:, :2], run.series("ego.position")
    apart = np.hypot(*(foot - ego).T)
    moved = np.flatnonzero((foot != foot[0]).any(axis=1))[0]
    # a driven entity has taken its step already when others look
    assert apart[moved - 1] > 40.0 - 10.0 * STEP
    first = np.hypot(*(foot[0] - ego).T)
    assert moved == np.flatnonzero(first <= 40.0)[0]
    np.testing.assert_allclose(foot[moved], (-50.0, 6.0 - 3.0 * STEP))
    assert run.of("waits", "velocity")[5, 0] == 0.0
    assert run.of("waits", "velocity")[6, 0] == pytest.approx(-2.0)


def test_a_body_that_enters_later_moves_nobody_else_before(tmp_path: Path) -> None:
    """Who is not there yet is nowhere; from its time on it follows its own trajectory."""
    walks = (Vertex(time=1.0, x=-40.0, y=-20.0),)
    foot = Entity(
        type=PEDESTRIAN, position=Position(x=-40.0, y=-10.0), trajectory=walks, enters=1.0
    )
    entities = {"stands": Entity(type="van", position=Position(x=-60.0, y=-8.0)), "foot": foot}
    run = simulate(scene(tmp_path), 2.5, entities)
    np.testing.assert_array_equal(
        np.unique(run.of("stands", "position")[:, :2], axis=0), [(-60, -8)]
    )
    y = run.of("foot", "position")[:, 1]
    there = ~np.isnan(y)
    assert int(np.flatnonzero(there)[0]) == 10
    np.testing.assert_allclose(np.diff(y[there])[:9], -10.0 * STEP, atol=1e-9)
    assert y[-1] == -20.0


@pytest.mark.parametrize(("bound", "begins"), [(50.0, True), (math.nextafter(50.0, 0.0), False)])
def test_close_enough_is_as_far_as_the_bound(tmp_path: Path, *, bound: float, begins: bool) -> None:
    """Two who stand 50 m apart, 30 m along and 40 m across."""
    trigger = Trigger(entity="stands", closer_than=bound)
    walks = (Vertex(time=1.0, x=-11.0, y=-48.0),)
    entities = {
        "stands": Entity(type="van", position=Position(x=-40.0, y=-8.0)),
        "foot": Entity(
            type=PEDESTRIAN,
            position=Position(x=-10.0, y=-48.0),
            trajectory=walks,
            trigger=trigger,
        ),
    }
    run = simulate(scene(tmp_path), 1.0, entities)
    assert run.of("foot", "position")[-1, 0] == pytest.approx(-11.0 if begins else -10.0)


def test_nobody_starts_before_the_one_it_looks_at_has_entered(tmp_path: Path) -> None:
    late = car("west_3_0", 60.0, enters=1.0)
    trigger = Trigger(entity="late")
    entities = {
        "late": late,
        "a": Entity(
            type="van", position=Position(x=-40.0, y=-8.0), trajectory=CORNERS, trigger=trigger
        ),
    }
    run = simulate(scene(tmp_path), 2.0, entities)
    moved = (run.of("a", "position") != run.of("a", "position")[0]).any(axis=1)
    assert int(np.flatnonzero(moved)[0]) == 11


def test_the_ego_sees_and_hits_a_pedestrian_who_steps_onto_the_road(tmp_path: Path) -> None:
    """Two bodies whose ways cross at the same time; with more speed the ego has passed."""
    crossing = Entity(
        type=PEDESTRIAN,
        position=Position(x=-50.0, y=4.4),
        trajectory=(Vertex(time=8.0, x=-50.0, y=-7.6),),  # on the centre of the lane after 4 s
    )

    def met(speed: float) -> Run:
        front = 100.0 + 52.5 - 4.0 * speed  # so far from the pedestrian's way in 4 s
        ego = car("east_1_0", front, speed=Constant(speed), controller="policy")
        return simulate(scene(tmp_path), 6.0, {"ego": ego, "foot": crossing})

    run = met(10.0)
    row = run.row(0, "foot")
    assert run.array(0, "vehicle.body")[row] == Body.PEDESTRIAN
    assert run.array(0, "vehicle.size")[row] == pytest.approx((0.215, 0.478, 1.719))
    assert run.series("ego.collision")[-1]
    assert run.series("ego.collision_partner")[-1] == run.number["foot"]
    touched = float(run.series("ego.collision_time")[-1])
    # the way is 1.8 m wide, at 1.5 m/s, and the ego as long as it takes 0.5 s
    assert 3.0 < touched < 4.0
    k = round(touched / STEP) - 2
    assert 0.0 < run.array(k, "ego.gap") < 2.5
    assert run.array(k, "ego.nearest") == run.number["foot"]
    assert run.array(k + 3, "ego.gap") == 0.0
    assert run.series("encounter.over")[-1]


def test_traffic_of_sumo_brakes_for_what_stands_on_its_lane(tmp_path: Path) -> None:
    """A body that is put onto the lane stops a car that SUMO drives; beside it, it does not."""

    def last(y: float) -> float:
        van = Entity(type="van", position=Position(x=-50.0, y=y))
        entities = {"van": van, "a": car("east_1_0", 30.0, speed=Constant(10.0))}
        return float(simulate(scene(tmp_path), 15.0, entities).of("a", "position")[-1, 0])

    assert -62.0 < last(-1.6) < -53.0
    assert last(-6.0) > -40.0
