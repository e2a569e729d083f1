"""Changes of lane: their polynomial, and the vehicle that drives along them."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, strategies as st

from adapters.sumo.ego import Command, EgoState, advance
from fmus.driving.policy.ego import Ego
from fmus.driving.policy.lane_change import LaneChange, beside, length_of_change
from fmus.driving.policy.steering import follow
from orchestrator.signal import Array
from tests.fmus.dynamics import DYNAMICS

CHANGE = LaneChange(begin=10.0, length=28.0, start=0.0, end=3.5)
STRAIGHT = np.array([[0.0, 0.0], [200.0, 0.0]])


def test_the_steepest_and_the_most_curved_place_are_those_of_the_fifth_degree() -> None:
    """15/8 in the middle, 10 / sqrt(3) at (1 -+ 1 / sqrt(3)) / 2 of the way."""
    offset, slope, curvature = CHANGE.at(10.0 + 14.0)
    assert offset == pytest.approx(1.75)
    assert slope == pytest.approx(15 / 8 * 3.5 / 28.0)
    assert curvature == pytest.approx(0.0, abs=1e-12)
    for share, sign in ((0.5 - 0.5 / math.sqrt(3.0), 1.0), (0.5 + 0.5 / math.sqrt(3.0), -1.0)):
        most = CHANGE.at(10.0 + 28.0 * share)[2]
        assert most == pytest.approx(sign * 10.0 / math.sqrt(3.0) * 3.5 / 28.0**2)
    way = np.linspace(10.0, 38.0, 2801)
    slopes = np.diff(CHANGE.offset(way)) / np.diff(way)
    assert slopes.max() == pytest.approx(15 / 8 * 3.5 / 28.0, rel=1e-4)


def test_it_begins_and_ends_on_the_lanes() -> None:
    assert CHANGE.offset(np.array([0.0, 10.0, 38.0, 100.0])) == pytest.approx([0.0, 0.0, 3.5, 3.5])
    assert CHANGE.at(10.0) == (0.0, 0.0, 0.0)
    assert CHANGE.at(38.0) == (3.5, 0.0, 0.0)
    assert not CHANGE.is_over(37.9)
    assert CHANGE.is_over(38.0)


@given(way=st.floats(10.0, 38.0), length=st.floats(5.0, 60.0))
def test_who_changes_his_mind_goes_on_without_a_jump(way: float, length: float) -> None:
    """Offset, slope and curvature are those of the change before; the end is the lane."""
    back = CHANGE.towards(0.0, way, length)
    assert back.at(way) == pytest.approx(CHANGE.at(way), abs=1e-9)
    nearly = back.at(way + length * (1.0 - 1e-9))
    assert nearly == pytest.approx((0.0, 0.0, 0.0), abs=1e-6)
    assert back.mirrored().offset(np.array([way + 1.0])) == -back.offset(np.array([way + 1.0]))


@pytest.mark.parametrize("speed", [8.0, 10.0, 20.0])
def test_its_length_is_that_of_the_lateral_acceleration(speed: float) -> None:
    length = length_of_change(3.5, speed, 2.5)
    assert speed**2 * 10.0 / math.sqrt(3.0) * 3.5 / length**2 == pytest.approx(2.5)


def test_at_walking_pace_it_is_as_long_as_half_the_slope_takes() -> None:
    assert 15 / 8 * 3.5 / length_of_change(3.5, 1.0, 2.5) == pytest.approx(0.5)
    assert length_of_change(-3.5, 1.0, 2.5) == length_of_change(3.5, 1.0, 2.5)


def test_beside_a_straight_route_the_path_is_at_the_offset() -> None:
    path = beside(STRAIGHT, CHANGE, 4.0)
    assert path[:, 0] == pytest.approx(np.linspace(0.0, 200.0, 201))
    assert path[:, 1] == pytest.approx(CHANGE.offset(4.0 + path[:, 0]))


@pytest.mark.parametrize("offset", [3.5, -3.5])
def test_beside_a_bend_the_path_is_a_bend_of_another_radius(offset: float) -> None:
    """A bend of 60 m to the left: left of its middle it is narrower, as is its way."""
    angle = np.linspace(0.0, 1.5, 400)
    route = 60.0 * np.column_stack([np.sin(angle), 1.0 - np.cos(angle)])
    path = beside(route, replace(CHANGE, start=offset, end=offset), 0.0)
    radius = np.hypot(path[:, 0], path[:, 1] - 60.0)
    assert radius[1:-1] == pytest.approx(60.0 - offset, abs=0.01)


def test_in_its_lane_the_path_is_the_route_itself() -> None:
    assert beside(STRAIGHT, CHANGE.towards(0.0, 40.0, 20.0), 60.0) is STRAIGHT


def drive(speed: float, seconds: float) -> tuple[Array, Array, Array]:
    """Offset [m], lateral speed [m/s] and lateral acceleration [m/s^2] while it changes lanes."""
    change = replace(CHANGE, length=length_of_change(3.5, speed, 2.5))
    state, found = EgoState(x=0.0, y=0.0, heading=0.0, speed=speed), []
    for _ in range(round(seconds / 0.05)):
        route = np.array([[state.x, 0.0], [state.x + 150.0, 0.0]])
        ego = Ego(
            vehicle=1,
            position=np.array([state.x, state.y]),
            heading=state.heading,
            speed=state.speed,
            length=4.93,
            width=1.86,
            route=beside(route, change, state.x),
        )
        steer = follow(ego)
        for _ in range(5):
            state = advance(state, Command(accelerate=0.0, brake=0.0, steer=steer), DYNAMICS, 0.01)
            turn = state.speed**2 * math.tan(state.steering) / DYNAMICS.wheelbase
            found.append((state.y, state.speed * math.sin(state.heading), turn))
    offset, lateral, acceleration = np.array(found).T
    return offset, lateral, acceleration


@pytest.mark.parametrize("speed", [5.0, 10.0, 20.0])
def test_the_vehicle_moves_sideways_no_faster_than_planned(speed: float) -> None:
    """It follows with a delay, so it is smoother than its path; it ends within 5 cm of the lane."""
    offset, lateral, acceleration = drive(speed, 10.0)
    length = length_of_change(3.5, speed, 2.5)
    assert offset[-1] == pytest.approx(3.5, abs=0.05)
    assert offset.max() < 3.5 + 0.15
    assert 0.7 < lateral.max() / (speed * 15 / 8 * 3.5 / length) < 1.0
    assert np.abs(acceleration).max() < 2.5
