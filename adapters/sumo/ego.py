r"""Dynamics of the ego vehicle: a kinematic single track with actuators.

Dead times come before all of this; see `actuation`.

Longitudinal: the commanded acceleration $u$ is $-b_{max}$ times the brake pedal, or $a_{max}$
times the accelerator; the acceleration follows it with a lag, $\tau \dot a = u - a$. No rolling
or air resistance: with both pedals released the speed stays constant. No reverse: at standstill
the brake holds, and releasing the pedals keeps it so.

Lateral: the kinematic single-track model (Rajamani, Vehicle Dynamics and Control, 2nd ed., 2012,
section 2.2), $\dot\psi = v \tan\delta / l$ at the rear axle; the road-wheel angle $\delta$ follows
the command at a bounded rate.

Both are solved in closed form for constant command and angle, so that the sub-step length only
resolves the motion of the steering wheel.
"""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from adapters.traffic.geometry import Float

_BISECTIONS: Final = 50
_STRAIGHT: Final = 1e-12
"""Change of heading [rad] below which an arc is evaluated as a chord (relative error 1e-25)."""


@dataclass(frozen=True, slots=True, kw_only=True)
class EgoDynamics:
    """Constants of the ego vehicle.

    Attributes:
        wheelbase: between the axles [m]; they lie symmetrically to the body's centre.
        max_acceleration: at full accelerator [m/s^2].
        max_braking: at full brake [m/s^2], positive.
        actuator_lag: time constant of the acceleration [s].
        max_steering: largest road-wheel angle [rad], at a steering command of 1.
        max_steering_rate: of the road-wheel angle [rad/s].
    """

    wheelbase: float
    max_acceleration: float
    max_braking: float
    actuator_lag: float
    max_steering: float
    max_steering_rate: float


@dataclass(frozen=True, slots=True, kw_only=True)
class EgoState:
    """State of the ego vehicle.

    Attributes:
        x, y: centre of the body [m].
        heading: counter-clockwise from east [rad].
        speed: of the rear axle, along the heading [m/s], never negative.
        acceleration: along the heading [m/s^2].
        steering: road-wheel angle [rad], left positive.
    """

    x: float
    y: float
    heading: float
    speed: float
    acceleration: float = 0.0
    steering: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Command:
    """What the driving policy asks for, within the range of the pedals and the wheel."""

    accelerate: float
    brake: float
    steer: float

    @classmethod
    def of(cls, signal: Float) -> "Command":
        """The command in a signal: accelerate 0..1, brake 0..1, steer -1..1, shape (3,).

        Values beyond these bounds act like the bounds: a pedal has a stop.

        Raises:
            ValueError: a value is not finite.
        """
        if not np.isfinite(signal).all():
            raise ValueError(
                f"`command` is {signal.tolist()}; accelerate, brake and steer must be finite"
            )
        accelerate, brake, steer = np.clip(signal, [0.0, 0.0, -1.0], 1.0).tolist()
        return cls(accelerate=accelerate, brake=brake, steer=steer)


RELEASED: Final = Command(accelerate=0.0, brake=0.0, steer=0.0)
"""No foot on a pedal, the wheel straight."""


def advance(state: EgoState, command: Command, dynamics: EgoDynamics, duration: float) -> EgoState:
    """The state after `duration` [s] under a constant command; the brake overrides."""
    if command.brake > 0.0:
        target = -dynamics.max_braking * command.brake
    else:
        target = dynamics.max_acceleration * command.accelerate
    travel, speed, acceleration = _longitudinal(state, target, dynamics.actuator_lag, duration)
    swing = dynamics.max_steering_rate * duration
    wanted = command.steer * dynamics.max_steering
    steering = state.steering + min(max(wanted - state.steering, -swing), swing)
    mean_steering = 0.5 * (state.steering + steering)
    x, y, heading = _move(state, travel, mean_steering, dynamics.wheelbase)
    return EgoState(
        x=x, y=y, heading=heading, speed=speed, acceleration=acceleration, steering=steering
    )


def stopping_distance(speed: float, dynamics: EgoDynamics) -> float:
    """Distance [m] that full braking from `speed` [m/s] takes, the actuator's lag included."""
    state = EgoState(x=0.0, y=0.0, heading=0.0, speed=speed)
    longest = speed / dynamics.max_braking + 50.0 * dynamics.actuator_lag
    return _longitudinal(state, -dynamics.max_braking, dynamics.actuator_lag, longest)[0]


def velocity(state: EgoState) -> Float:
    """The velocity of the body's centre [m/s], shape (2,): rear axle's plus the turn about it."""
    cos, sin = math.cos(state.heading), math.sin(state.heading)
    sideways = 0.5 * state.speed * math.tan(state.steering)
    return np.array([state.speed * cos - sideways * sin, state.speed * sin + sideways * cos])


def _longitudinal(
    state: EgoState, target: float, lag: float, duration: float
) -> tuple[float, float, float]:
    """Travel [m], speed [m/s] and acceleration [m/s^2] after `duration` [s]."""
    lowest = _time_of_lowest_speed(state, target, lag, duration)
    if _free_motion(state, target, lag, lowest)[1] >= 0.0 and (state.speed > 0.0 or target > 0.0):
        return _free_motion(state, target, lag, duration)
    stop = _time_of_stop(state, target, lag, lowest)
    travel = _free_motion(state, target, lag, stop)[0]
    if target <= 0.0:
        return travel, 0.0, 0.0
    rest = EgoState(x=0.0, y=0.0, heading=0.0, speed=0.0)  # the accelerator was down already
    onward, speed, acceleration = _free_motion(rest, target, lag, duration - stop)
    return travel + onward, speed, acceleration


def _time_of_lowest_speed(state: EgoState, target: float, lag: float, duration: float) -> float:
    """The time [s] in [0, duration] at which the free motion is slowest, or the end of braking."""
    if target <= 0.0:
        return duration
    if state.acceleration >= 0.0:
        return 0.0
    return min(duration, lag * math.log1p(-state.acceleration / target))  # where a(t) = 0


def _free_motion(
    state: EgoState, target: float, lag: float, duration: float
) -> tuple[float, float, float]:
    r"""Travel [m], speed [m/s] and acceleration [m/s^2] after `duration` [s].

    It moves as if the speed could become negative: $a(t) = u + (a_0 - u) e^{-t/\tau}$, integrated.
    """
    excess = state.acceleration - target
    decay = -math.expm1(-duration / lag)  # 1 - e^(-t / tau)
    acceleration = target + excess * (1.0 - decay)
    speed = state.speed + target * duration + excess * lag * decay
    travel = (
        state.speed * duration
        + 0.5 * target * duration**2
        + excess * lag * (duration - lag * decay)
    )
    return travel, speed, acceleration


def _time_of_stop(state: EgoState, target: float, lag: float, lowest: float) -> float:
    """The time [s] in [0, lowest] at which the free motion has no speed left."""
    if state.speed <= 0.0:
        return 0.0
    low, high = 0.0, lowest
    for _ in range(_BISECTIONS):  # the speed is positive at `low`, not at `high`
        middle = 0.5 * (low + high)
        if _free_motion(state, target, lag, middle)[1] > 0.0:
            low = middle
        else:
            high = middle
    return high


def _move(
    state: EgoState, travel: float, steering: float, wheelbase: float
) -> tuple[float, float, float]:
    """Centre [m] and heading [rad] after the rear axle moved `travel` [m] on a circular arc."""
    turn = travel * math.tan(steering) / wheelbase
    chord = travel if abs(turn) < _STRAIGHT else travel * math.sin(0.5 * turn) / (0.5 * turn)
    course, heading = state.heading + 0.5 * turn, state.heading + turn
    arm = 0.5 * wheelbase
    x = state.x + chord * math.cos(course) + arm * (math.cos(heading) - math.cos(state.heading))
    y = state.y + chord * math.sin(course) + arm * (math.sin(heading) - math.sin(state.heading))
    return x, y, math.remainder(heading, 2.0 * math.pi)
