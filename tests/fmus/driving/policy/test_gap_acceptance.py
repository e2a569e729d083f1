"""The times of passing and dropping back against kinematics, and the clearance they leave."""

import math

import pytest
from hypothesis import assume, given, strategies as st

from fmus.driving.policy.following import following
from fmus.driving.policy.gap_acceptance import clearance, time_to_gain, time_to_lose

SPEEDS = st.floats(0.0, 30.0)
DISTANCES = st.floats(0.1, 100.0)


def test_from_equal_speeds_the_time_is_that_of_the_acceleration() -> None:
    """d = a t^2 / 2: 16 m with 2 m/s^2 take 4 s; beyond the cruising speed it is the difference.

    From 5 to 10 m/s it takes 2.5 s and gains 6.25 m; the other 10 m take 2 s at 5 m/s more.
    """
    assert time_to_gain(16.0, 5.0, 5.0, acceleration=2.0, cruise=50.0) == pytest.approx(4.0)
    assert time_to_gain(16.25, 5.0, 5.0, acceleration=2.0, cruise=10.0) == pytest.approx(4.5)
    assert time_to_gain(10.0, 12.0, 10.0, acceleration=2.0, cruise=10.0) == pytest.approx(5.0)


def test_to_drop_back_one_brakes_and_then_waits() -> None:
    """At equal speeds d = b t^2 / 2; who stands after 2.5 s and 6.25 m waits for the rest."""
    assert time_to_lose(4.0, 5.0, 5.0, braking=2.0) == pytest.approx(2.0)
    assert time_to_lose(16.25, 5.0, 5.0, braking=2.0) == pytest.approx(2.5 + 2.0)
    assert time_to_lose(3.0, 10.0, 8.0, braking=2.0) == pytest.approx(3.0)  # 9 m less 2 m/s x 3 s
    assert time_to_lose(1.0, 10.0, 4.0, braking=2.0) == pytest.approx(5.0 + 6.0 / 4.0)


def test_nobody_is_passed_who_is_not_slower_and_nobody_waited_for_who_stands() -> None:
    assert time_to_gain(1.0, 10.0, 12.0, acceleration=2.0, cruise=12.0) == math.inf
    assert time_to_lose(1.0, 5.0, 0.0, braking=2.0) == math.inf
    assert time_to_gain(-1.0, 10.0, 12.0, acceleration=2.0, cruise=12.0) == 0.0
    assert time_to_lose(-1.0, 5.0, 0.0, braking=2.0) == 0.0


@given(
    distance=DISTANCES, speed=SPEEDS, other=SPEEDS, cruise=SPEEDS, acceleration=st.floats(0.5, 4)
)
def test_after_the_time_the_distance_is_gained(
    distance: float, speed: float, other: float, cruise: float, acceleration: float
) -> None:
    time = time_to_gain(distance, speed, other, acceleration=acceleration, cruise=cruise)
    assume(time < 1000.0)
    ramp = min(time, max(cruise - speed, 0.0) / acceleration)
    way = speed * ramp + 0.5 * acceleration * ramp**2 + max(cruise, speed) * (time - ramp)
    assert way - other * time == pytest.approx(distance, rel=1e-6, abs=1e-6)


@given(distance=DISTANCES, speed=SPEEDS, other=SPEEDS, braking=st.floats(0.5, 8.0))
def test_after_the_time_the_distance_is_lost(
    distance: float, speed: float, other: float, braking: float
) -> None:
    time = time_to_lose(distance, speed, other, braking=braking)
    assume(time < 1000.0)
    slowing = min(time, speed / braking)
    way = speed * slowing - 0.5 * braking * slowing**2
    assert other * time - way == pytest.approx(distance, rel=1e-6, abs=1e-6)


def test_the_clearance_is_what_is_left_over_the_closing_speed() -> None:
    """120 m apart at 10 m/s each: after 5 s 20 m are left, a second."""
    assert clearance(120.0, 10.0, way=50.0, speed=10.0, time=5.0) == pytest.approx(1.0)
    assert clearance(90.0, 10.0, way=50.0, speed=10.0, time=5.0) == pytest.approx(-0.5)
    assert clearance(10.0, -12.0, way=50.0, speed=10.0, time=5.0) == math.inf
    assert clearance(10.0, -5.0, way=50.0, speed=5.0, time=5.0) == -math.inf


def test_behind_somebody_at_a_constant_speed_one_comes_to_rest_at_the_headway() -> None:
    """At the gap s0 + v T nothing is done; from 10 m/s behind 4 m/s it is reached unhurt."""

    def keep(speed: float, gap: float) -> float:
        return following(
            speed, gap, 4.0, acceleration=2.0, braking=3.4, headway=1.0, standstill=2.0
        )

    assert keep(4.0, 6.0) == pytest.approx(0.0)
    assert keep(4.0, 12.0) == pytest.approx(2.0 * (1.0 - 0.25))
    speed, gap, hardest = 10.0, 30.0, 0.0
    for _ in range(6000):
        acceleration = keep(speed, gap)
        hardest = min(hardest, acceleration)
        gap += 0.01 * (4.0 - speed)
        speed = max(speed + 0.01 * acceleration, 0.0)
        assert gap > 5.0
    assert speed == pytest.approx(4.0, abs=0.01)
    assert gap == pytest.approx(6.0, abs=0.05)
    assert hardest > -3.4
