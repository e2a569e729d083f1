"""When, with whom and whether: collision and completion at the finer step."""

import math
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import assume, given, strategies as st

from adapters.sumo import SumoTraffic
from adapters.sumo.outcome import NEVER, Instants, Outcome
from adapters.sumo.population import Poses
from adapters.sumo.proximity import Contact, closest_approach
from adapters.traffic.geometry import Boxes, box_distance
from orchestrator.randomness import stream
from orchestrator.signal import Signals
from tests.adapters.red_light import ALONE, STEP as H, ego_speed, entity, red_light

SPARSE = {"spacing": 60.0}
PARAMETERS = red_light(background=SPARSE)
COLLIDER = 1
COAST = np.zeros(3)
BRAKE = np.array([0.0, 1.0, 0.0])
GO = np.array([1.0, 0.0, 0.0])
JUNCTION_END, CONFLICT = 8.25, -5.25
"""North end of the junction and conflict point on the ego's route [m]; see the plan."""
HALF_EGO = 4.93 / 2

Float = npt.NDArray[np.float64]


def run(
    seed: int,
    policy: Callable[[float], Float],
    seconds: float,
    parameters: Any = PARAMETERS,
    start: int = 0,
) -> Iterator[tuple[float, Signals]]:
    """Time since the start [s] and outputs at each communication point."""
    traffic = SumoTraffic(parameters)
    traffic.setup(start, stream(seed, "traffic"))
    try:
        yield 0.0, traffic.outputs()
        for k in range(round(seconds * 1e9) // H):
            traffic.step({"ego.command": policy(k * H / 1e9)}, start + k * H, H)
            yield (k + 1) * H / 1e9, traffic.outputs()
    finally:
        traffic.close()


def coast(_: float) -> Float:
    return COAST


def value(signals: Signals, name: str) -> float:
    return float(np.asarray(signals[name]))


# ---- two bodies on straight ways: closed forms


class Meeting:
    """The ego drives north along x = 0 at `speed`; the other one starts at `place`."""

    def __init__(self, speed: float, place: Float, velocity: Float, size: Float) -> None:
        self.speed, self.place, self.velocity = speed, place, velocity
        self.ego_size, self.size = np.array([4.93, 1.86]), size

    def first_seen(self, step: float, until: float) -> tuple[float, float] | None:
        """Collision time [s] and partner, looking every fifth of `step` [s]."""
        outcome, count = Outcome(), 5
        for k in range(math.ceil(until / step)):
            t0, t1 = k * step, (k + 1) * step
            looks = t0 + np.arange(1, count + 1) / count * step
            track = np.stack([0 * looks, self.speed * looks, 0 * looks + np.pi / 2], axis=1)
            found = closest_approach(
                track, self.ego_size, number=np.array([7]), size=self.size[None],
                a=self._pose(t0), b=self._pose(t1),
            )  # fmt: skip
            instants = Instants(begin=round(t0 * 1e9), duration=round(step * 1e9), count=count)
            outcome = outcome.after(instants, found.contact, None)
        return (outcome.collision_time, outcome.partner) if outcome.has_collided else None

    def _pose(self, t: float) -> Poses:
        return Poses(
            center=(self.place + t * self.velocity)[None],
            heading=np.arctan2(*self.velocity[::-1])[None],
            velocity=self.velocity[None],
        )


@given(st.floats(1.0, 15.0), st.floats(1.0, 15.0), st.floats(8.0, 30.0), st.floats(-1.5, 1.5))
def test_a_head_on_collision_is_seen_when_the_fronts_meet(
    speed: float, other: float, apart: float, beside: float
) -> None:
    """At (distance - both half lengths) / (sum of the speeds), rounded up to 10 ms."""
    size = np.array([4.63, 1.78])
    meeting = Meeting(speed, np.array([beside, apart]), np.array([0.0, -other]), size)
    exact = (apart - 0.5 * (4.93 + 4.63)) / (speed + other)
    found = meeting.first_seen(0.05, exact + 0.2)
    assert found is not None
    assert -1e-9 <= found[0] - exact <= 0.01 + 1e-9
    assert found[1] == 7


@given(st.floats(3.0, 15.0), st.floats(3.0, 15.0), st.floats(5.0, 20.0), st.floats(-20.0, -5.0))
def test_a_side_collision_is_seen_when_both_bodies_are_in_the_crossing(
    speed: float, other: float, north: float, west: float
) -> None:
    """Overlap begins when the later one of both reaches the other one's strip."""
    size = np.array([4.63, 1.78])
    along = np.array([north - 0.5 * (4.93 + 1.78), north + 0.5 * (4.93 + 1.78)]) / speed
    across = np.array([-west - 0.5 * (4.63 + 1.86), -west + 0.5 * (4.63 + 1.86)]) / other
    enters, leaves = max(along[0], across[0]), min(along[1], across[1])
    assume(enters > 0.0)
    assume(not -1e-6 < leaves - enters < 0.02)  # a graze shorter than the grid may be missed
    meeting = Meeting(speed, np.array([west, north]), np.array([other, 0.0]), size)
    found = meeting.first_seen(0.05, enters + 0.2)
    if leaves < enters:
        assert found is None
    else:
        assert found is not None
        assert -1e-9 <= found[0] - enters <= 0.01 + 1e-9


@pytest.mark.parametrize("second", [0, 1])
def test_the_partner_is_the_first_one_hit_not_the_nearest_at_the_end(second: int) -> None:
    """Two stand in the way, 0.2 m behind each other; both are overlapped at the end."""
    looks = np.arange(1, 6)
    track = np.stack([0 * looks, 0.1 * looks, 0 * looks + np.pi / 2], axis=1)
    front = np.array([HALF_EGO + 2.315 + (0.05 if k == second else 0.25) for k in range(2)])
    pose = Poses(
        center=np.stack([0 * front, front], axis=1),
        heading=np.full(2, np.pi / 2),
        velocity=np.zeros((2, 2)),
    )
    found = closest_approach(
        track, np.array([4.93, 1.86]), number=np.array([3, 8]),
        size=np.tile([4.63, 1.78], (2, 1)), a=pose, b=pose,
    )  # fmt: skip
    assert found.contact == Contact(0, (3, 8)[second])
    assert found.gap == 0.0


# ---- what happened first stays


def instants(begin: int = 0) -> Instants:
    return Instants(begin=begin, duration=H, count=5)


def test_instants_are_spread_evenly_up_to_the_end() -> None:
    assert [instants().seconds(k) for k in range(5)] == [0.01, 0.02, 0.03, 0.04, 0.05]
    assert instants(3 * H).seconds(4) == 0.2
    assert Instants(begin=H, duration=0, count=1).seconds(0) == 0.05


def test_the_first_collision_stays() -> None:
    once = Outcome().after(instants(), Contact(2, 9), None)
    assert (once.collision_time, once.partner, once.is_over) == (0.03, 9, True)
    assert once.after(instants(H), Contact(0, 4), 1) == once


def test_a_collision_after_completing_counts_and_completing_after_a_collision_does_not() -> None:
    both = Outcome().after(instants(), Contact(3, 9), 1)
    assert (both.completion_time, both.collision_time) == (0.02, 0.04)
    late = Outcome().after(instants(), Contact(3, 9), 3)
    assert (late.completion_time, late.collision_time) == (NEVER, 0.04)
    done = Outcome().after(instants(), None, 4)
    assert done.after(instants(H), None, 0) == done
    hit = done.after(instants(H), Contact(0, 9), 0)
    assert (hit.completion_time, hit.collision_time) == (0.05, 0.06)


# ---- in traffic


@pytest.mark.parametrize("seed", range(3))
def test_the_collision_in_traffic_is_that_of_a_ten_times_finer_search(seed: int) -> None:
    """By brute force over the bodies between the last two communication points."""
    previous, end = dict[str, Any](), 0.0
    for t, signals in run(seed, coast, 18.0):
        end = t
        if signals["ego.collision"]:
            break
        assert not signals["encounter.over"]
        assert value(signals, "ego.collision_time") == NEVER
        assert signals["ego.collision_partner"] == -1
        previous = dict(signals)
    assert signals["encounter.over"]
    assert signals["ego.collision_partner"] == COLLIDER
    looks = np.linspace(0.0, 1.0, 51)[:, None]

    def between(name: str, row: int) -> Float:
        before, after = (np.asarray(s[name])[row, ..., None] for s in (previous, signals))
        return np.asarray(before.T + looks * (after - before).T)

    boxes = [
        Boxes(
            center=between("vehicle.position", row)[:, :2],
            heading=between("vehicle.heading", row)[:, 0],
            size=np.asarray(signals["vehicle.size"])[row, :2],
        )
        for row in (0, COLLIDER)
    ]
    overlap = np.flatnonzero(box_distance(*boxes) <= 0.0)
    finer = end - 0.05 + 0.001 * overlap[0]
    assert -1e-9 <= value(signals, "ego.collision_time") - finer <= 0.01 + 1e-9


def test_the_collision_time_is_kept_and_who_has_collided_does_not_complete() -> None:
    found = {
        (value(s, "ego.collision_time"), int(np.asarray(s["ego.collision_partner"])))
        for _, s in run(1, coast, 24.0)
        if s["ego.collision"]
    }
    assert len(found) == 1
    *_, (_, last) = run(1, coast, 24.0)
    assert np.asarray(last["ego.position"])[1] > CONFLICT + 15.0 + HALF_EGO
    assert value(last, "ego.completion_time") == NEVER


def test_times_are_those_of_the_simulation_whenever_it_starts() -> None:
    *_, (_, early) = run(2, coast, 18.0)
    *_, (_, late) = run(2, coast, 18.0, start=5 * 10**9)
    shifted = value(early, "ego.collision_time") + 5.0
    assert value(late, "ego.collision_time") == pytest.approx(shifted, abs=1e-9)


@pytest.mark.parametrize("finish", [0.0, 15.0, 40.0])
def test_alone_it_completes_so_far_beyond_the_junction(finish: float) -> None:
    """At constant speed: (way of the rear bumper) / speed, rounded up to 10 ms."""
    ego = {"position": {"to_end": 30.0}, "finish": {"distance": finish}}
    parameters = red_light(background=SPARSE, entities={"ego": ego, **ALONE})
    (_, first), *later = run(1, coast, 12.0, parameters)
    rear = np.asarray(first["ego.position"])[1] - HALF_EGO
    exact = (JUNCTION_END + finish - rear) / ego_speed(PARAMETERS)
    over = [(t, value(s, "ego.completion_time")) for t, s in later if s["encounter.over"]]
    assert {time for _, time in over} == {over[0][1]}
    assert -1e-9 <= over[0][1] - exact <= 0.01 + 1e-9
    assert 0.0 <= over[0][0] - over[0][1] < 0.05
    assert len(over) + round(over[0][0] / 0.05) - 1 == len(later)


def test_in_an_encounter_it_completes_beyond_the_conflict_point() -> None:
    """It lets the collision vehicle pass, and drives on."""

    def careful(t: float) -> Float:
        return BRAKE if 14.5 < t < 18.0 else GO if 18.0 <= t < 20.0 else COAST

    previous = -np.inf
    signals: Signals = {}
    for _, signals in run(1, careful, 30.0):
        assert not signals["ego.collision"]
        if signals["encounter.over"]:
            break
        previous = float(np.asarray(signals["ego.position"])[1])
    finish = entity(PARAMETERS, "ego").finish
    assert finish is not None
    line = CONFLICT + finish.distance + HALF_EGO
    assert previous < line <= np.asarray(signals["ego.position"])[1]
    assert value(signals, "ego.completion_time") > 20.0


def test_who_leaves_the_net_has_completed_however_far_the_line() -> None:
    ego = {"position": {"to_end": 0.0}, "finish": {"distance": 1000.0}}
    parameters = red_light(background=SPARSE, entities={"ego": ego, **ALONE})
    left = 0.0
    for t, signals in run(0, coast, 35.0, parameters):
        left = t
        if signals["ego.id"] == -1:
            break
        assert not signals["encounter.over"]
    assert signals["encounter.over"]
    assert left < 30.0
    assert value(signals, "ego.completion_time") == pytest.approx(left)
