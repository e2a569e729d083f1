"""Overtaking on a two-way road: what is accepted, and what is done when somebody comes."""

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import scenarios
from adapters.sumo.ego import EgoState
from fmus.driving.policy import Blind, Inputs, RuleBased
from fmus.driving.policy.ego import Ego
from fmus.driving.policy.overtaking_parameters import Overtaking
from fmus.driving.policy.passing import Drive, Situation
from fmus.driving.policy.road_users import RoadUsers
from fmus.driving.policy.route import Segments
from fmus.messages.records import OBJECT, frame
from fmus.physics.boxes import corners
from orchestrator.cli import main
from orchestrator.signal import Array
from tests.fmus.boxes import put
from tests.fmus.driving.policy.two_way_road import (
    CRUISE,
    SIZE,
    TRUCK,
    Other,
    Trip,
    oncoming,
    signals,
    trip,
    truck,
)

WANTED = Overtaking()
DRIVE = Drive(cruise=CRUISE, acceleration=2.0, lateral_margin=0.4)
LENGTH = 10.0 * math.sqrt(10.0 / math.sqrt(3.0) * 3.5 / 2.5)
"""Of a change of lanes at the cruising speed [m]."""


def situation(*vehicles: Other, speed: float = 4.0, wanted: Overtaking = WANTED) -> Situation:
    route = np.array([[0.0, 0.0], [400.0, 0.0]])
    center = np.array([(v.x, v.y) for v in vehicles])
    others = RoadUsers.along(
        Segments.of(route),
        corners(center, np.zeros(len(center)), np.array([v.size for v in vehicles])),
        np.array([(v.speed, v.aside) for v in vehicles]),
    )
    ego = Ego(
        vehicle=1,
        position=np.zeros(2),
        heading=0.0,
        speed=speed,
        length=SIZE[0],
        width=SIZE[1],
        route=route,
    )
    return Situation(ego=ego, others=others, wanted=wanted, drive=DRIVE)


def completing(*vehicles: Other, speed: float = 4.0) -> float:
    """The clearance of a pass [s]."""
    found = situation(*vehicles, speed=speed)
    column = found.ahead()
    assert column is not None
    return found.completing(column).clearance


def test_a_pass_takes_as_long_as_its_way_at_the_speeds_of_both() -> None:
    """Behind a truck of 8 m at 4 m/s, 6 m ahead: to gain are 6 + 8 + 4.93 + 6 m.

    From 4 to 10 m/s it takes 3 s and gains 9 m; the rest goes at 6 m/s, 0.3 s to be sure and the
    return at 10 m/s. In this time who comes at 15 m/s comes nearer; 1 s of clearance is 25 m.
    """
    time = 3.0 + (6.0 + 8.0 + SIZE[0] + 6.0 - 9.0) / 6.0 + 0.3 + LENGTH / CRUISE
    way = 21.0 + CRUISE * (time - 3.0)
    gap = way + 15.0 * time + 25.0
    assert completing(truck(6.0), oncoming(gap, 15.0)) == pytest.approx(1.0)
    assert completing(truck(6.0), oncoming(gap - 25.0, 15.0)) == pytest.approx(0.0)
    assert completing(truck(6.0)) == math.inf
    assert time == pytest.approx(8.8, abs=0.01)
    assert gap == pytest.approx(236.0, abs=0.5)


@pytest.mark.parametrize("more", [1.0, -1.0])
def test_it_passes_iff_who_comes_leaves_the_clearance(more: float) -> None:
    """At the time of the decision, 1 s after the start; a metre decides.

    Until then ego and truck keep 4 m/s and the gap, at which the expert follows: 3 m and 1 s.
    """
    low, high = 150.0, 400.0
    for _ in range(40):
        gap = 0.5 * (low + high)
        is_enough = completing(truck(7.0), oncoming(gap, 15.0)) >= 1.0
        low, high = (low, gap) if is_enough else (gap, high)
    found = trip(4.0, truck(7.0), oncoming(high + 1.0 * (4.0 + 15.0) + more, 15.0))
    assert (found.offset.max() > 1.0) == (more > 0.0)


def leaves_at(found: Trip) -> float:
    return found.time(np.abs(found.offset) > 0.05)


def test_it_passes_a_slow_truck_and_returns() -> None:
    """From its decision until less than 1 m is left it takes 8.8 s, as the model says."""
    found = trip(16.0, truck(6.0))
    assert found.offset.max() == pytest.approx(3.5, abs=0.15)
    assert found.offset[-1] == pytest.approx(0.0, abs=0.05)
    assert found.states[-1].x > found.vehicles[0].x
    assert found.gap.min() > 0.8
    back = len(found.offset) - np.argmax(np.abs(found.offset[::-1]) > 1.0)
    assert 0.05 * back - WANTED.patience == pytest.approx(8.8, abs=0.2)


def test_it_waits_until_the_patience_is_over() -> None:
    first, second = trip(6.0, truck(6.0)), trip(6.0, truck(6.0), patience=3.0)
    assert leaves_at(second) - leaves_at(first) == pytest.approx(2.0, abs=0.1)


@pytest.mark.slow
def test_it_passes_the_same_way_on_any_road_and_on_the_other_side() -> None:
    straight = trip(12.0, truck(6.0)).offset
    assert trip(12.0, truck(6.0), turn=2.0).offset == pytest.approx(straight, abs=1e-3)
    assert trip(12.0, truck(6.0), side="right").offset == pytest.approx(-straight, abs=1e-6)


@pytest.mark.parametrize("pace", [0.0, 2.0, 6.0])
def test_who_comes_up_from_behind_passes_at_any_pace(pace: float) -> None:
    found = trip(30.0, truck(60.0, speed=pace), speed=9.0)
    assert found.states[-1].x > found.vehicles[0].x + 10.0
    assert found.offset[-1] == pytest.approx(0.0, abs=0.05)
    assert found.gap.min() > 0.8


@pytest.mark.parametrize(
    "others",
    [
        (truck(6.0, speed=8.0),),  # hardly slower than the cruising speed
        (truck(6.0), oncoming(60.0, 0.0)),  # somebody stands on the other lane
        (truck(6.0), Other(x=60.0, y=-20.0, aside=4.0)),  # turns into it soon
        (truck(6.0), Other(x=-30.0, y=3.5, speed=14.0)),  # overtakes the ego itself
    ],
)
def test_it_does_not_pass(others: tuple[Other, ...]) -> None:
    found = trip(3.0, *others, speed=others[0].speed)
    assert np.abs(found.offset).max() < 0.01


def test_it_waits_for_who_comes_and_passes_afterwards() -> None:
    found = trip(25.0, truck(6.0), oncoming(120.0, 12.0))
    assert leaves_at(found) > 120.0 / (4.0 + 12.0)
    assert found.offset.max() == pytest.approx(3.5, abs=0.15)
    assert found.states[-1].x > found.vehicles[0].x
    assert found.gap.min() > 0.8


def test_it_drops_back_if_it_learns_in_time_of_somebody() -> None:
    """It is 1.7 s out, behind the truck still, when somebody is known 114 m ahead, at 12 m/s."""
    car = oncoming(157.0, 12.0)
    found = trip(12.0, truck(6.0), appears=(2.7, car))
    assert found.offset.max() > 0.3
    meeting = int(np.argmax([s.x > car.after(0.05 * k).x for k, s in enumerate(found.states)]))
    assert meeting > 0
    assert abs(found.offset[meeting]) < 0.3
    assert found.states[meeting].x < truck(6.0).after(0.05 * meeting).x
    assert found.gap.min() > 0.8


def test_beyond_the_critical_position_it_goes_on() -> None:
    """The truck is almost passed when somebody is known: it completes the pass."""
    car = oncoming(400.0, 20.0)
    found = trip(12.0, truck(6.0), appears=(6.5, car))
    assert found.states[-1].x > found.vehicles[0].x
    assert found.offset[-1] == pytest.approx(0.0, abs=0.2)
    assert found.gap.min() > 0.8


def test_the_clearances_cross_at_one_critical_position() -> None:
    """As the ego comes by, completing leaves more and more, and dropping back less and less."""
    complete, back = [], []
    for lead in np.arange(6.0, -12.5, -1.0):
        found = situation(truck(float(lead)), oncoming(100.0, 12.0), speed=8.0)
        column = found.ahead()
        assert column is not None
        complete.append(found.completing(column).clearance)
        back.append(found.dropping_back(column).clearance)
    assert (np.diff(complete) > 0.0).all()
    assert (np.diff(back) <= 0.0).all()
    better = np.array(complete) > np.array(back)
    assert not better[0]
    assert better[-1]
    assert np.count_nonzero(np.diff(better)) == 1


def test_who_drives_close_together_is_passed_together() -> None:
    """Between two trucks there must be room for the ego and 6 m before and behind it."""
    room = SIZE[0] + 2 * (2.0 + 4.0)
    for gap, front in ((room - 0.1, 2), (room + 0.1, 1)):
        second = truck(6.0 + TRUCK[0] + gap)
        column = situation(truck(6.0), second).ahead()
        assert column is not None
        ends = 0.5 * SIZE[0] + 6.0 + TRUCK[0], second.x + 0.5 * TRUCK[0]
        assert column.front == pytest.approx(ends[front - 1])
        assert column.rear == pytest.approx(0.5 * SIZE[0] + 6.0)


def test_a_follower_is_not_to_be_passed() -> None:
    behind = Other(x=-6.0, speed=4.0)
    found = situation(truck(6.0), behind)
    assert found.ahead() == situation(truck(6.0)).ahead()


def test_nobody_passes_where_the_road_turns_or_ends() -> None:
    """The way of this pass is 76 m; the road turns after 40 m, or ends after 70 m."""
    found = situation(truck(6.0))
    column = found.ahead()
    assert column is not None
    for degrees, is_straight in ((0.0, True), (25.0, True), (35.0, False)):
        turn = math.radians(degrees)
        bend = np.array([40.0, 0.0])
        end = bend + 200.0 * np.array([math.cos(turn), math.sin(turn)])
        turned = replace(found.ego, route=np.array([[0.0, 0.0], bend, end]))
        assert replace(found, ego=turned).is_straight(column) == is_straight
    short = replace(found.ego, route=np.array([[0.0, 0.0], [70.0, 0.0]]))
    assert not replace(found, ego=short).is_straight(column)


def record(vehicle: Other, sensor: int, now: int) -> Array:
    """The vehicle as an `OBJECT` record, shape (1,)."""
    found = np.zeros(1, OBJECT)
    center, half = np.array([vehicle.x, vehicle.y]), 0.5 * np.array(vehicle.size)
    found["sensor"], found["instance"], found["time"] = sensor, 7, now
    put(found, center - half, center + half)
    found["velocity"] = vehicle.speed, vehicle.aside
    return found


@pytest.mark.parametrize(("policy", "passes"), [(RuleBased, False), (Blind, True)])
def test_what_others_told_of_keeps_it_in_its_lane(policy: Any, passes: bool) -> None:  # noqa: FBT001
    """The truck is seen, the oncoming car only received; after the patience the wheel turns."""
    driver = policy(policy.Parameters(cruise_speed=CRUISE, overtaking=WANTED))
    driver.begin(0, np.random.default_rng(0))
    steered = []
    for k in range(40):
        time, now = 0.05 * k, 50_000_000 * k
        state = EgoState(x=4.0 * time, y=0.0, heading=0.0, speed=4.0)
        known = dict(signals(state, (), 0.0))
        known["objects"] = frame("OBJS", record(truck(6.0).after(time), 4, now))
        told = record(oncoming(150.0, 12.0).after(time), 5, now)
        known["received.objects"] = frame("OBJS", told)
        steered.append(driver.drive(Inputs.read(known, driver.reads), now).steer)
    assert steered[:20] == [0.0] * 20
    assert (max(steered[20:]) > 0.0) == passes


@pytest.mark.parametrize(
    ("written", "complaint"),
    [
        ("offset: 0 m", "offset: must be at least 1.5 m, got 0 m"),
        ("side: up", 'side: cannot be "up"; there are: left, right'),
        ("patience: -1 s", "patience: must be at least 0 s, got -1 s"),
        ("clearance: 3 m", 'clearance: "3 m": expected a time (s), got a length (m)'),
        ("braking: 0 m/s2", "braking: must be at least 0.1 m/s^2, got 0 m/s^2"),
        ("gap: 2 m", "gap: there is no parameter `gap`; there are: advantage, braking, clearance"),
    ],
)
def test_what_cannot_be_is_refused_at_its_line_and_column(
    written: str, complaint: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    shipped = Path(scenarios.__file__).with_name("overtaking.yaml")
    text = shipped.read_text(encoding="utf-8")
    assert text.count("overtaking: {}") == 1
    text = text.replace("overtaking: {}", f"overtaking: {{{written}}}")
    text = text.replace("assets/", f"{shipped.parent.as_posix()}/assets/")
    changed = tmp_path / "changed.yaml"
    changed.write_text(text, encoding="utf-8")
    assert main(["check", str(changed)]) != 0
    lines = text.splitlines()
    row = next(k for k, line in enumerate(lines) if written in line)
    key = lines[row].index(written)
    found = capsys.readouterr()
    said = next(one for one in (found.out + found.err).splitlines() if "changed.yaml:" in one)
    column = key if "there is no parameter" in complaint else key + written.index(" ") + 1
    place = f"changed.yaml:{row + 1}:{column + 1}: components.policy.parameters.overtaking."
    assert place + complaint in said


@pytest.mark.parametrize("speed", [-0.5, 0.0])
def test_who_rolls_back_behind_the_ego_is_passed_with_room_for_who_stands(speed: float) -> None:
    """Away from it: less room than for who stands still is never enough."""
    half, gap = 0.5 * SIZE[0], WANTED.standstill
    for near, is_left in ((gap - 0.1, True), (gap + 0.1, False)):
        found = situation(Other(x=-2.0 * half - near, speed=speed)).left_to_pass()
        assert (found is not None) == is_left
