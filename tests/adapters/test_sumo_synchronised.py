"""A synchronised vehicle arrives where another one does, when it does, within its bounds."""

from pathlib import Path

import pytest
from hypothesis import given, strategies as st

from adapters.sumo.entities import Entity, Synchronise
from adapters.sumo.synchronised import SpeedControl
from orchestrator.distribution import Constant
from tests.adapters.sumo_runs import car, on, scene, simulate

CONTROL = SpeedControl(
    hold_distance=25.0, min_speed=20 / 3.6, max_speed=60 / 3.6, max_acceleration=3.0
)
H = 0.05


def approach(
    distance: float, speed: float, other_distance: float, other_speed: float
) -> tuple[float, float]:
    """Distance of the other one, and own speed, when this one is at the meeting."""
    while distance > 0.0:
        speed = CONTROL.speed(
            speed=speed,
            distance=distance,
            other_speed=other_speed,
            other_distance=other_distance,
            h=H,
        )
        distance -= speed * H
        other_distance -= other_speed * H
    return other_distance, speed


@given(st.floats(90.0, 200.0), st.floats(6.0, 12.0), st.floats(5.0, 12.0))
def test_it_meets_another_one_that_keeps_its_speed(
    distance: float, speed: float, other_speed: float
) -> None:
    """Whatever speed it starts with, as long as the speed that fits is within its bounds."""
    fitting = 9.0  # m/s
    other_distance, _ = approach(distance, speed, distance * other_speed / fitting, other_speed)
    assert abs(other_distance) < 1.0


def test_within_the_hold_distance_the_speed_is_kept_whatever_the_other_one_does() -> None:
    for other_speed in (0.0, 5.0, 30.0):
        speed = CONTROL.speed(
            speed=9.0, distance=25.0, other_speed=other_speed, other_distance=20.0, h=H
        )
        assert speed == 9.0


def test_for_another_one_that_stands_it_slows_down_to_its_smallest_speed_no_further() -> None:
    other_distance, speed = approach(150.0, 12.0, 100.0, 0.0)
    assert other_distance == 100.0
    assert speed == pytest.approx(20 / 3.6)


def test_the_acceleration_is_bounded() -> None:
    faster = CONTROL.speed(speed=8.0, distance=100.0, other_speed=20.0, other_distance=50.0, h=H)
    assert faster == pytest.approx(8.0 + 3.0 * H)


@pytest.mark.parametrize("beyond", [0.0, 5.0])
def test_once_the_other_one_has_passed_the_speed_is_kept(beyond: float) -> None:
    """At the meeting itself no speed would fit any more."""
    kept = CONTROL.speed(speed=9.0, distance=80.0, other_speed=8.0, other_distance=-beyond, h=H)
    assert kept == 9.0


@pytest.mark.parametrize(("speed", "s"), [(6.0, 40.0), (9.0, 80.0), (9.0, 150.0)])
@pytest.mark.parametrize("place", [{}, {"x": 1.6, "y": -21.6}])
def test_without_a_place_on_its_lane_it_starts_as_far_in_time_from_the_meeting(
    tmp_path: Path, speed: float, s: float, place: dict[str, float]
) -> None:
    """By the centres of both bodies, at their speeds at the start."""
    meeting = Synchronise(entity="ego", hold_distance=1.0, **place)
    entities = {
        "ego": car("east_1_0", s, speed=Constant(8.0), controller="policy"),
        "b": Entity(
            type="van", position=on("north_1_0"), speed=Constant(speed), synchronise=meeting
        ),
    }
    run = simulate(scene(tmp_path), 0.0, entities)
    time = (place.get("x", 1.6) - run.of("ego", "position")[0, 0]) / 8.0
    y = run.of("b", "position")[0, 1]
    assert (place.get("y", -1.6) - y) / speed == pytest.approx(time, abs=1e-9)


def test_who_would_start_before_its_lane_starts_at_its_beginning(tmp_path: Path) -> None:
    """With its rear there; at the speed it has it comes too early."""
    meeting = Synchronise(entity="ego", hold_distance=1.0)
    entities = {
        "ego": car("east_1_0", 20.0, speed=Constant(4.0), controller="policy"),
        "b": car("north_1_0", speed=Constant(9.0), synchronise=meeting),
    }
    run = simulate(scene(tmp_path), 0.1, entities)
    assert run.of("b", "position")[0, 1] == pytest.approx(-200.0 + 2.5)
