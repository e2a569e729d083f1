"""Pure pursuit with the dynamics of the ego vehicle: it comes back to its route and stays."""

import dataclasses
import math
from collections.abc import Iterator

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, strategies as st

from adapters.sumo.ego import Command, EgoState, advance
from adapters.traffic.polyline import Polyline
from fmus.driving.policy.ego import Ego
from fmus.driving.policy.steering import SteeringParameters, follow
from tests.fmus.dynamics import DYNAMICS

Float = npt.NDArray[np.float64]
STEP = 0.05
PARAMETERS = SteeringParameters()
BELIEVED = dataclasses.replace(
    DYNAMICS, wheelbase=PARAMETERS.wheelbase, max_steering=PARAMETERS.max_steering
)
"""As the driver believes them to be."""
STRAIGHT = np.array([[7.0, -200.0], [7.0, -8.25], [7.0, 8.25], [7.0, 300.0]])


def arc(radius: float, turn: float) -> Float:
    """40 m straight to the north, an arc to the left (right: negative `radius`), 100 m straight."""
    angle = np.linspace(0.0, turn, 60)
    x = radius * (np.cos(angle) - 1.0)
    bend = np.column_stack([x, abs(radius) * np.sin(angle)])
    along = np.array([-math.copysign(1.0, radius) * math.sin(turn), math.cos(turn)])
    return np.vstack([[0.0, -40.0], bend, bend[-1] + 100.0 * along])


def drive(
    route: Float, *, speed: float, left: float = 0.0, turned: float = 0.0, seconds: float
) -> Iterator[tuple[EgoState, float]]:
    """The states and commands on the way along `route`, which starts to the north."""
    path = Polyline(route)
    x, y = (route[0] + (-left, 5.0)).tolist()
    state = EgoState(x=x, y=y, heading=0.5 * math.pi + turned, speed=speed)
    for _ in range(round(seconds / STEP)):
        command = steer(state, path.beyond(path.station(state.x, state.y)))
        yield state, command
        pedals = Command(accelerate=0.0, brake=0.0, steer=command)
        for _ in range(5):
            state = advance(state, pedals, BELIEVED, STEP / 5)


def steer(state: EgoState, route: Float, parameters: SteeringParameters = PARAMETERS) -> float:
    ego = Ego(
        vehicle=1,
        position=np.array([state.x, state.y]),
        heading=state.heading,
        speed=state.speed,
        length=4.9,
        width=1.9,
        route=route,
    )
    return follow(ego, parameters)


def offset(route: Float, state: EgoState) -> float:
    """Distance of the rear axle to the route [m]."""
    path = Polyline(route)
    arm = 0.5 * BELIEVED.wheelbase
    x, y = state.x - arm * math.cos(state.heading), state.y - arm * math.sin(state.heading)
    return float(np.hypot(*(path.at(path.station(x, y)) - (x, y))))


@pytest.mark.parametrize("speed", [2.0, 20 / 3.6, 30 / 3.6, 50 / 3.6])
@pytest.mark.parametrize(("left", "turned"), [(1.0, 0.0), (-1.0, 0.0), (0.0, 0.17), (-1.0, -0.17)])
def test_it_returns_to_a_straight_route_and_does_not_swing(
    left: float, turned: float, speed: float
) -> None:
    """Offsets fall by a factor of e per lookahead (see below): after seven, 1 m is a millimetre."""
    lookahead = max(PARAMETERS.lookahead, PARAMETERS.lookahead_time * speed)
    seconds = 7.0 * lookahead / speed
    states = [s for s, _ in drive(STRAIGHT, speed=speed, left=left, turned=turned, seconds=seconds)]
    assert offset(STRAIGHT, states[-1]) < 0.01
    assert abs(states[-1].heading - 0.5 * math.pi) < math.radians(0.2)
    beyond = [math.copysign(1.0, left or turned) * (s.x - STRAIGHT[0, 0]) for s in states]
    assert max(beyond) < 0.2


def test_small_offsets_decay_as_the_linear_solution_says() -> None:
    r"""With lookahead d, $y'' + 2 y' / d + 2 y / d^2 = 0$ along the route, for the rear axle.

    Hence $y = y_0 e^{-s/d} (\cos s/d + \sin s/d)$. The wheel's rate hardly matters at low speed.
    """
    speed, left, d = 1.0, 0.1, PARAMETERS.lookahead
    for state, _ in drive(STRAIGHT, speed=speed, left=left, seconds=20.0):
        arm = 0.5 * BELIEVED.wheelbase
        travelled = (state.y - arm * math.sin(state.heading) - (STRAIGHT[0, 1] + 5.0 - arm)) / d
        found = STRAIGHT[0, 0] - (state.x - arm * math.cos(state.heading))
        wanted = left * math.exp(-travelled) * (math.cos(travelled) + math.sin(travelled))
        assert found == pytest.approx(wanted, abs=0.003)


@pytest.mark.parametrize("radius", [12.0, -12.0, 30.0, -30.0])
def test_it_returns_to_a_curved_route(radius: float) -> None:
    """It enters the bend 1 m off; within and behind it, it keeps to the centre of its lane."""
    speed = min(30 / 3.6, math.sqrt(3.0 * abs(radius)))  # 3 m/s^2 across
    route = arc(radius, 0.5 * math.pi)
    length = 40.0 + 0.5 * math.pi * abs(radius) + 60.0
    states = [
        s for s, _ in drive(route, speed=speed, left=1.0, turned=0.17, seconds=length / speed)
    ]
    bend = [s for s in states if s.y > 0.0]
    assert max(offset(route, s) for s in bend) < 0.5
    assert offset(route, states[-1]) < 0.01


def test_on_a_circle_it_takes_the_angle_of_the_circle() -> None:
    """Ackermann: the rear axle of a wheelbase l on radius r needs atan(l / r)."""
    radius = 20.0
    angle = np.linspace(-1.0, 1.5, 2000)
    route = radius * np.column_stack([np.cos(angle), np.sin(angle)])
    rear = EgoState(x=radius, y=0.5 * PARAMETERS.wheelbase, heading=0.5 * math.pi, speed=5.0)
    wanted = math.atan2(PARAMETERS.wheelbase, radius) / PARAMETERS.max_steering
    assert steer(rear, route) == pytest.approx(wanted, rel=1e-4)


@given(
    st.floats(-180, 180),
    st.floats(0, 20),
    st.sampled_from([0.0, 0.5, -0.5, 1.0]),
    st.sampled_from([0.0, 7.0, 1000.0]),
)
def test_without_an_offset_a_straight_route_takes_no_steering_at_all(
    place: float, speed: float, quarter: float, aside: float
) -> None:
    """Exactly none, in all four directions of the compass: rounding errors do not steer."""
    heading = quarter * math.pi
    ahead = np.array([round(math.cos(heading)), round(math.sin(heading))], dtype=np.float64)
    across = aside * np.array([ahead[1], ahead[0]])
    center = place * ahead + across
    route = center + np.outer([0.0, 3.0, 80.0], ahead)
    state = EgoState(x=float(center[0]), y=float(center[1]), heading=heading, speed=speed)
    command = steer(state, route)
    assert (command, math.copysign(1.0, command)) == (0.0, 1.0)


@given(st.floats(-5, 5), st.floats(-3, 3), st.floats(0, 20))
def test_left_and_right_are_alike(left: float, turned: float, speed: float) -> None:
    def command(sign: float) -> float:
        heading = 0.5 * math.pi + sign * turned
        state = EgoState(x=-sign * left, y=0.0, heading=heading, speed=speed)
        return steer(state, np.array([[0.0, 0.0], [0.0, 50.0]]))

    assert command(1.0) == pytest.approx(-command(-1.0), abs=1e-8)
    assert -1.0 <= command(1.0) <= 1.0


def test_a_vehicle_the_wrong_way_round_turns_as_sharply_as_it_can() -> None:
    state = EgoState(x=-0.5, y=0.0, heading=-0.5 * math.pi, speed=5.0)
    assert abs(steer(state, np.array([[0.0, 0.0], [0.0, 50.0]]))) == 1.0


def test_without_a_route_the_wheel_stays_straight() -> None:
    state = EgoState(x=3.0, y=0.0, heading=1.0, speed=5.0)
    for route in (np.zeros((0, 2)), np.zeros((1, 2)), np.zeros((3, 2))):
        assert steer(state, route) == 0.0
