"""The generation rules of ETSI TS 103 324 V2.1.1, clause 6.1.2.3, as a table of cases."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, strategies as st

from fmus.facilities.cpm_rules import Inclusion, InclusionRules, Station
from fmus.messages.records import OBJECT
from tests.fmus.boxes import put

SECOND = 1_000_000_000
RULES = InclusionRules(
    longest=SECOND,
    position_change=4.0,
    speed_change=0.5,
    orientation_change=math.radians(4.0),
    orientation_speed=0.5,
)
LAST = Inclusion(time=0, position=np.array([10.0, 20.0]), velocity=np.array([6.0, 8.0]))
SPEED = 10.0


def turned(degrees: float, speed: float = SPEED) -> Inclusion:
    angle = math.atan2(8.0, 6.0) + math.radians(degrees)
    velocity = speed * np.array([math.cos(angle), math.sin(angle)])
    return Inclusion(time=1, position=LAST.position, velocity=velocity)


def moved(x: float, y: float) -> Inclusion:
    return replace(LAST, time=1, position=LAST.position + np.array([x, y]))


@pytest.mark.parametrize(
    ("current", "included"),
    [
        (replace(LAST, time=100_000_000), False),  # nothing has changed
        (moved(4.0, 0.0), False),  # "exceeds": 4 m are not enough
        (moved(4.001, 0.0), True),
        (moved(-2.9, 2.9), True),  # the distance counts, not the coordinates
        (moved(2.8, 2.8), False),
        (turned(0.0, speed=10.4999), False),
        (turned(0.0, speed=10.5001), True),
        (turned(0.0, speed=9.4999), True),
        (turned(3.99), False),
        (turned(-3.99), False),
        (turned(4.01), True),
        (turned(-4.01), True),
        (turned(180.0), True),
        (replace(LAST, time=SECOND - 1), False),
        (replace(LAST, time=SECOND), True),  # not included for T_GenCpmMax
        (replace(turned(3.9, speed=10.4), time=SECOND - 1, position=LAST.position + 2.8), False),
    ],
)
def test_each_trigger_alone_includes_an_object(current: Inclusion, *, included: bool) -> None:
    assert RULES.include(current, LAST) is included


def test_a_new_object_is_included() -> None:
    assert RULES.include(LAST, None)


@pytest.mark.parametrize(("speed", "included"), [(0.49, False), (0.51, True)])
def test_the_direction_of_hardly_any_velocity_says_nothing(speed: float, *, included: bool) -> None:
    velocity = np.array([speed, 0.0])
    last = replace(LAST, velocity=velocity)
    assert RULES.include(replace(last, time=1, velocity=-velocity), last) is included


@given(
    st.floats(-179, 179),
    st.floats(0.6, 40.0),
    st.floats(-math.pi, math.pi),
)
def test_what_turned_does_not_depend_on_where_north_is(
    degrees: float, speed: float, north: float
) -> None:
    def state(angle: float) -> Inclusion:
        velocity = speed * np.array([math.cos(angle), math.sin(angle)])
        return Inclusion(time=0, position=np.zeros(2), velocity=velocity)

    if abs(abs(degrees) - 4.0) > 1e-6:
        expected = abs(degrees) > 4.0
        assert RULES.include(state(north + math.radians(degrees)), state(north)) is expected


def scan(*numbers: int, time: int = 0, x: float = 0.0) -> np.ndarray:
    rows = np.zeros(len(numbers), OBJECT)
    rows["instance"], rows["time"] = numbers, time
    put(rows, [x, 0.0], [x + 2.0, 4.0])
    return rows


def chosen(station: Station, objects: np.ndarray, now: int, most: int = 100) -> list[int]:
    marked = station.select(objects, now, most)
    return [int(number) for number in objects["instance"][marked]]


def test_an_object_at_rest_is_included_when_new_and_then_once_per_second() -> None:
    station = Station(RULES)
    events = range(0, 3 * SECOND + 1, SECOND // 10)
    included = [now for now in events if chosen(station, scan(7), now)]
    assert included == [0, SECOND, 2 * SECOND, 3 * SECOND]


def test_change_is_counted_from_the_last_inclusion_not_from_the_last_event() -> None:
    """At 20 m/s, 2 m per event: 4 m are exceeded at every third one."""
    station = Station(RULES)
    events = [(k, chosen(station, scan(7, x=2.0 * k), k * SECOND // 10)) for k in range(10)]
    assert [k for k, numbers in events if numbers] == [0, 3, 6, 9]


def test_an_object_that_comes_back_into_view_at_once_is_not_new() -> None:
    station = Station(RULES)
    assert chosen(station, scan(7), 0) == [7]
    assert chosen(station, scan(), SECOND // 10) == []
    assert chosen(station, scan(7), SECOND // 5) == []


def test_who_waited_longest_comes_first_when_there_is_no_room() -> None:
    station = Station(RULES)
    objects = scan(1, 2, 3)
    assert chosen(station, objects, 0, most=2) == [1, 2]
    assert chosen(station, objects, 1, most=2) == [3]
    assert chosen(station, objects, SECOND, most=1) == [1]
    assert chosen(station, objects, SECOND, most=1) == [2]


def test_ages_count_from_the_first_scan_of_an_unbroken_track() -> None:
    station = Station(RULES)
    station.select(scan(7, time=100), 200, 9)
    station.select(scan(7, 8, time=300), 400, 9)
    assert station.ages(scan(7, 8), 400).tolist() == [300, 100]
    station.select(scan(8, time=500), 600, 9)
    station.select(scan(7, 8, time=700), 800, 9)
    assert station.ages(scan(7, 8), 800).tolist() == [100, 500]
