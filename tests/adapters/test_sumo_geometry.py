import math

import numpy as np
import pytest
from hypothesis import given, strategies as st

from adapters.traffic.geometry import Boxes, box_distance
from adapters.traffic.polyline import Polyline

coordinate = st.floats(-20.0, 20.0)
angle = st.floats(-math.pi, math.pi)
extent = st.floats(0.5, 12.0)


@st.composite
def boxes(draw: st.DrawFn) -> Boxes:
    return Boxes(
        center=np.array([draw(coordinate), draw(coordinate)]),
        heading=np.array(draw(angle)),
        size=np.array([draw(extent), draw(extent)]),
    )


def moved(box: Boxes, turn: float, shift: tuple[float, float]) -> Boxes:
    cos, sin = math.cos(turn), math.sin(turn)
    matrix = np.array([[cos, -sin], [sin, cos]])
    return Boxes(center=matrix @ box.center + shift, heading=box.heading + turn, size=box.size)


def contains(box: Boxes, points: np.ndarray, margin: float) -> np.ndarray:
    """Whether `points` lie inside `box` by at least `margin`, independently of the code."""
    cos, sin = math.cos(float(box.heading)), math.sin(float(box.heading))
    local = (points - box.center) @ np.array([[cos, -sin], [sin, cos]])
    inside: np.ndarray = (np.abs(local) <= 0.5 * box.size - margin).all(axis=-1)
    return inside


def grid(box: Boxes, count: int) -> np.ndarray:
    """Points all over `box`, edges included."""
    along, across = np.meshgrid(*[np.linspace(-0.5, 0.5, count)] * 2)
    cos, sin = math.cos(float(box.heading)), math.sin(float(box.heading))
    local = np.stack([along.ravel(), across.ravel()], axis=1) * box.size
    return np.asarray(local @ np.array([[cos, sin], [-sin, cos]]) + box.center)


@given(boxes(), boxes())
def test_distance_is_symmetric(a: Boxes, b: Boxes) -> None:
    assert box_distance(a, b) == pytest.approx(float(box_distance(b, a)), abs=1e-9)


@given(boxes(), boxes(), angle, st.tuples(coordinate, coordinate))
def test_distance_does_not_depend_on_the_frame(
    a: Boxes, b: Boxes, turn: float, shift: tuple[float, float]
) -> None:
    apart = float(box_distance(moved(a, turn, shift), moved(b, turn, shift)))
    assert apart == pytest.approx(float(box_distance(a, b)), abs=1e-9)


@given(boxes(), boxes())
def test_no_point_of_one_box_is_closer_to_the_other_than_the_distance(a: Boxes, b: Boxes) -> None:
    """Both ways, with a grid of points: the distance is the minimum, to the grid's resolution."""
    p, q = grid(a, 25), grid(b, 25)
    sampled = np.hypot(*(p[:, None] - q[None]).transpose(2, 0, 1)).min()
    resolution = math.hypot(*a.size) / 24 + math.hypot(*b.size) / 24
    distance = float(box_distance(a, b))
    assert sampled - resolution <= distance <= sampled + 1e-9


@given(boxes(), boxes())
def test_the_distance_is_zero_where_a_point_is_inside_both(a: Boxes, b: Boxes) -> None:
    both = contains(a, grid(b, 25), 1e-9) & contains(b, grid(b, 25), 1e-9)
    if both.any():
        assert box_distance(a, b) == 0.0


def test_a_cross_overlaps_although_no_corner_lies_in_the_other_box() -> None:
    long = Boxes(center=np.zeros(2), heading=np.array(0.0), size=np.array([10.0, 1.0]))
    across = Boxes(center=np.zeros(2), heading=np.array(math.pi / 2), size=np.array([10.0, 1.0]))
    assert box_distance(long, across) == 0.0


def test_distance_from_an_edge_to_a_corner() -> None:
    """The corner of a square turned by 45 degrees points at the edge of another."""
    square = Boxes(center=np.zeros(2), heading=np.array(0.0), size=np.array([2.0, 2.0]))
    diamond = Boxes(
        center=np.array([5.0, 0.3]), heading=np.array(math.pi / 4), size=np.array([2.0, 2.0])
    )
    assert box_distance(square, diamond) == pytest.approx(5.0 - 1.0 - math.sqrt(2.0))


def test_many_boxes_at_once_give_what_single_calls_give() -> None:
    rng = np.random.default_rng(1)
    a = Boxes(
        center=rng.uniform(-9, 9, (3, 1, 2)), heading=rng.uniform(-3, 3, (3, 1)), size=np.ones(2)
    )
    b = Boxes(
        center=rng.uniform(-9, 9, (5, 2)),
        heading=rng.uniform(-3, 3, 5),
        size=rng.uniform(1, 9, (5, 2)),
    )
    together = box_distance(a, b)
    assert together.shape == (3, 5)
    for i in range(3):
        for j in range(5):
            single = box_distance(
                Boxes(center=a.center[i, 0], heading=a.heading[i, 0], size=a.size),
                Boxes(center=b.center[j], heading=b.heading[j], size=b.size[j]),
            )
            assert together[i, j] == pytest.approx(float(single), abs=1e-12)


CORNER = Polyline(np.array([[0.0, 0.0], [10.0, 0.0], [10.0, 5.0]]))


@given(st.floats(0.0, 15.0))
def test_the_station_of_a_point_on_the_line_leads_back_to_it(station: float) -> None:
    assert CORNER.station(*CORNER.at(station).tolist()) == pytest.approx(station, abs=1e-9)


def test_what_lies_beyond_a_station_begins_there_and_has_the_remaining_length() -> None:
    rest = CORNER.beyond(4.0)
    np.testing.assert_allclose(rest, [[4.0, 0.0], [10.0, 0.0], [10.0, 5.0]])
    assert Polyline(rest).length == pytest.approx(CORNER.length - 4.0)


def test_crossing_is_the_first_one_along_the_line() -> None:
    zigzag = Polyline(np.array([[7.0, -1.0], [7.0, 1.0], [3.0, 1.0], [3.0, -1.0]]))
    first, other_way = CORNER.crossing(zigzag), zigzag.crossing(CORNER)
    assert first is not None
    assert other_way is not None
    np.testing.assert_allclose(first, [3.0, 0.0])
    np.testing.assert_allclose(other_way, [7.0, 0.0])
    assert CORNER.crossing(Polyline(np.array([[0.0, 1.0], [9.0, 1.0]]))) is None
