import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given, strategies as st

from adapters.sumo.ego import (
    Command,
    EgoState,
    advance,
    stopping_distance,
    velocity,
)
from tests.fmus.dynamics import DYNAMICS

START = EgoState(x=7.0, y=-145.0, heading=math.pi / 2, speed=30 / 3.6)
COAST = Command(accelerate=0.0, brake=0.0, steer=0.0)
BRAKE = Command(accelerate=0.0, brake=1.0, steer=0.0)
GO = Command(accelerate=1.0, brake=0.0, steer=0.0)
LEFT = Command(accelerate=0.0, brake=0.0, steer=1.0)
RIGHT = Command(accelerate=0.0, brake=0.0, steer=-1.0)


def drive(state: EgoState, command: Command, seconds: float, step: float = 0.01) -> EgoState:
    for _ in range(round(seconds / step)):
        state = advance(state, command, DYNAMICS, step)
    return state


def test_with_released_pedals_the_ego_keeps_speed_and_line() -> None:
    end = drive(START, COAST, 10.0)
    assert end.speed == START.speed
    assert end.x == pytest.approx(7.0, abs=1e-9)
    assert end.y == pytest.approx(-145.0 + 10.0 * START.speed)


def test_full_braking_takes_the_analytic_distance() -> None:
    """With t >> tau at standstill: v t - b t^2 / 2 + b tau t - b tau^2 where v = b (t - tau)."""
    b, tau, v = DYNAMICS.max_braking, DYNAMICS.actuator_lag, START.speed
    time = v / b + tau  # exp(-t / tau) = 1e-5 of b tau is neglected in the speed
    expected = v * time - b * time**2 / 2 + b * tau * time - b * tau**2
    end = drive(START, BRAKE, 3.0)
    assert end.speed == 0.0
    assert end.acceleration == 0.0
    assert end.y - START.y == pytest.approx(expected, abs=1e-3)
    assert stopping_distance(v, DYNAMICS) == pytest.approx(end.y - START.y, abs=1e-9)
    assert expected == pytest.approx(v**2 / (2 * b) + v * tau, abs=0.05)  # lag = reaction time


@given(
    st.floats(0.0, 20.0),
    st.floats(-8.0, 3.0),
    st.sampled_from([COAST, BRAKE, GO]),
    st.integers(1, 20),
)
def test_the_result_does_not_depend_on_the_sub_step(
    speed: float, acceleration: float, command: Command, parts: int
) -> None:
    start = dataclasses.replace(
        START, speed=speed, acceleration=acceleration if speed > 0.0 else 0.0
    )
    once = advance(start, command, DYNAMICS, 0.2)
    often = drive(start, command, 0.2, step=0.2 / parts)
    assert often.speed == pytest.approx(once.speed, abs=1e-9)
    assert often.y == pytest.approx(once.y, abs=1e-9)


@given(st.floats(0.0, 20.0), st.floats(-8.0, 3.0), st.sampled_from([COAST, BRAKE, GO]))
def test_the_ego_never_reverses(speed: float, acceleration: float, command: Command) -> None:
    start = dataclasses.replace(START, speed=speed, acceleration=acceleration)
    end = advance(start, command, DYNAMICS, 0.5)
    assert end.speed >= 0.0
    assert end.y >= start.y


def test_acceleration_approaches_the_command_with_the_time_constant() -> None:
    end = advance(START, GO, DYNAMICS, DYNAMICS.actuator_lag)
    assert end.acceleration == pytest.approx(3.0 * (1.0 - math.exp(-1.0)))


def test_the_brake_overrides_the_accelerator() -> None:
    both = Command(accelerate=1.0, brake=0.5, steer=0.0)
    half = Command(accelerate=0.0, brake=0.5, steer=0.0)
    assert advance(START, both, DYNAMICS, 0.1) == advance(START, half, DYNAMICS, 0.1)


def test_at_rest_the_ego_starts_again_only_with_the_accelerator() -> None:
    rest = dataclasses.replace(START, speed=0.0)
    assert drive(rest, COAST, 1.0) == rest
    assert drive(rest, GO, 1.0).speed > 2.0


def test_full_steering_drives_the_rear_axle_on_the_circle_of_the_single_track() -> None:
    """Radius l / tan(delta) at the rear axle; the steering reaches delta at its rate first."""
    turning = drive(START, LEFT, 1.0)
    assert turning.steering == pytest.approx(DYNAMICS.max_steering)
    radius = DYNAMICS.wheelbase / math.tan(DYNAMICS.max_steering)

    def center_of_circle(state: EgoState) -> np.ndarray:
        ahead = np.array([math.cos(state.heading), math.sin(state.heading)])
        rear = np.array([state.x, state.y]) - 0.5 * DYNAMICS.wheelbase * ahead
        return np.asarray(rear + radius * np.array([-ahead[1], ahead[0]]))

    later = drive(turning, LEFT, 0.7)
    np.testing.assert_allclose(center_of_circle(later), center_of_circle(turning), atol=1e-9)
    swept = math.remainder(later.heading - turning.heading, 2 * math.pi)
    assert swept == pytest.approx(math.remainder(0.7 * START.speed / radius, 2 * math.pi))


def test_steering_is_bounded_in_rate_to_either_side() -> None:
    """From straight on, and from one stop to the other."""
    rate, most = DYNAMICS.max_steering_rate, DYNAMICS.max_steering
    for side, command in ((1.0, LEFT), (-1.0, RIGHT)):
        assert drive(START, command, 0.5).steering == pytest.approx(side * 0.5 * rate)
        at_stop = dataclasses.replace(START, steering=-side * most)
        assert drive(at_stop, command, 0.5).steering == pytest.approx(side * (0.5 * rate - most))
        assert drive(at_stop, command, 3.0 * most / rate).steering == pytest.approx(side * most)


def test_velocity_is_the_derivative_of_the_position() -> None:
    state = drive(START, LEFT, 1.0)
    h = 1e-6
    later = advance(state, LEFT, DYNAMICS, h)
    moved = np.array([later.x - state.x, later.y - state.y]) / h
    np.testing.assert_allclose(velocity(state), moved, atol=1e-4)


def test_a_command_beyond_the_stops_acts_like_the_stop_and_nan_is_refused() -> None:
    clipped = Command.of(np.array([1.5, -0.2, -3.0]))
    assert clipped == Command(accelerate=1.0, brake=0.0, steer=-1.0)
    with pytest.raises(ValueError, match="accelerate, brake and steer must be finite"):
        Command.of(np.array([0.0, math.nan, 0.0]))
