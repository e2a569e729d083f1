"""What vehicles take up of the route, against exact polygons (shapely)."""

import math

import numpy as np
import pytest
from hypothesis import assume, given, strategies as st
from shapely.geometry import Polygon, box

from fmus.driving.policy.occupancy import Vehicles, occupancy, others, reaching
from fmus.driving.policy.route import Segments

LINE = Segments.of(np.array([[0.0, 0.0], [0.0, 30.0], [0.0, 100.0]]))
NOW = np.array([0.0, 0.1])


def bus(
    x: float, y: float, heading: float = 0.0, velocity: tuple[float, float] = (0.0, 0.0)
) -> Vehicles:
    """A bus with its centre at (x, y)."""
    return Vehicles(
        number=np.array([7]),
        center=np.array([[x, y]]),
        heading=np.array([heading]),
        size=np.array([[12.0, 2.55]]),
        velocity=np.array([velocity]),
    )


def outline(vehicle: Vehicles) -> Polygon:
    """By shapely's own affine transformations."""
    length, width = vehicle.size[0] / 2
    cos, sin = math.cos(vehicle.heading[0]), math.sin(vehicle.heading[0])
    x, y = vehicle.center[0]
    corners = [(length, width), (-length, width), (-length, -width), (length, -width)]
    return Polygon([(x + cos * a - sin * b, y + sin * a + cos * b) for a, b in corners])


@given(st.floats(-15, 15), st.floats(-20, 120), st.floats(-3.2, 3.2), st.floats(0.2, 3.0))
def test_it_is_the_extent_of_the_part_within_the_strip(
    x: float, y: float, heading: float, side: float
) -> None:
    vehicle = bus(x, y, heading)
    taken = occupancy(LINE, vehicle, NOW, side)
    part = outline(vehicle).intersection(box(-side, -100.0, side, 300.0))
    assume(part.is_empty or part.area > 1e-9)  # touching is within rounding errors
    if part.is_empty:
        assert np.isinf(taken.rear).all()
        assert np.isinf(taken.front).all()
    else:
        _, rear, _, front = part.bounds
        np.testing.assert_allclose(taken.rear, rear, atol=1e-6)
        np.testing.assert_allclose(taken.front, front, atol=1e-6)


@given(st.floats(-40, 40), st.floats(-20, 120), st.floats(-3.2, 3.2), st.floats(-9, 9))
def test_it_moves_with_the_vehicle(x: float, y: float, heading: float, speed: float) -> None:
    """Later is as now with the vehicle moved on."""
    velocity = (speed * math.cos(heading), speed * math.sin(heading))
    times = np.array([0.0, 0.5, 1.0])
    taken = occupancy(LINE, bus(x, y, heading, velocity), times, 1.4)
    for k, time in enumerate(times.tolist()):
        moved = bus(x + time * velocity[0], y + time * velocity[1], heading)
        at_once = occupancy(LINE, moved, NOW, 1.4)
        np.testing.assert_allclose(taken.rear[:, k], at_once.rear[:, 0], atol=1e-6)
        np.testing.assert_allclose(taken.front[:, k], at_once.front[:, 0], atol=1e-6)


@given(st.floats(-60, 60), st.floats(-60, 160), st.floats(-3.2, 3.2), st.floats(-15, 15))
def test_who_is_not_selected_takes_up_nothing(
    x: float, y: float, heading: float, speed: float
) -> None:
    vehicle = bus(x, y, heading, (speed * math.cos(heading), speed * math.sin(heading)))
    times, last, side = np.linspace(0.0, 5.0, 51), 60.0, 1.4
    taken = occupancy(LINE, vehicle, times, side)
    there = ((taken.front >= 0.0) & (taken.rear <= last)).any()
    assert reaching(vehicle, times, LINE.box(0.0, last, side))[0] or not there


def test_the_pace_is_what_gets_ahead_along_the_route() -> None:
    for velocity, pace in (((0.0, 6.0), 6.0), ((8.0, 0.0), 0.0), ((3.0, 4.0), 4.0), ((0, -5), 0.0)):
        assert occupancy(LINE, bus(0.0, 50.0, 0.0, velocity), NOW, 1.4).pace == pytest.approx(pace)


THREE = Vehicles(
    number=np.array([3, 5, 8]),
    center=np.zeros((3, 2)),
    heading=np.zeros(3),
    size=np.ones((3, 2)),
    velocity=np.zeros((3, 2)),
)


def test_others_are_all_but_the_ego() -> None:
    assert others(THREE, 5).number.tolist() == [3, 8]
    assert others(THREE, -1).number.tolist() == [3, 5, 8]  # the ego has left


def test_vehicles_without_the_ego_cannot_be_all() -> None:
    with pytest.raises(ValueError, match=r"`ego.id` 4, is not among the 3 .* policy.vehicle}"):
        others(THREE, 4)
