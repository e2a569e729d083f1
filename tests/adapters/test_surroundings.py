"""Outlines: open rings, their areas, and strips along polylines."""

import math

import numpy as np
import pytest
from hypothesis import given, strategies as st

from adapters.traffic.geometry import Float
from adapters.traffic.surroundings import Buildings, RoadSurface, area, open_ring, strip

SQUARE = np.array([(0.0, 0.0), (10.0, 0.0), (10.0, 10.0), (0.0, 10.0)])
FAR = np.array([5e5, 5.5e6])
"""As of UTM coordinates [m]."""


@pytest.mark.parametrize(
    ("last", "corners"), [((0.0, 0.0), 4), ((0.009, 0.0), 4), ((0.0, 0.011), 5), ((5.0, 5.0), 5)]
)
def test_a_ring_is_closed_by_a_corner_less_than_a_centimetre_from_the_first(
    last: tuple[float, float], corners: int
) -> None:
    ring = np.vstack([SQUARE, last])
    np.testing.assert_array_equal(open_ring(ring), ring[:corners])


def test_an_open_ring_is_left_as_it_is() -> None:
    assert open_ring(SQUARE) is SQUARE
    for count in (0, 1):
        assert len(open_ring(SQUARE[:count])) == count


def test_areas_are_those_of_the_shapes_wherever_they_are() -> None:
    """Either way round; to a tenth of a square centimetre at the coordinates of UTM."""
    bent = np.array([(0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (1.0, 1.0), (1.0, 3.0), (0.0, 3.0)])
    small = np.array([(0.0, 0.0), (0.3, 0.0), (0.3, 0.1), (0.0, 0.1)])
    for ring, expected in ((SQUARE, 100.0), (bent, 4.0), (small, 0.03), (SQUARE[:3], 50.0)):
        assert area(ring) == pytest.approx(expected, rel=1e-12)
        assert area(ring[::-1]) == pytest.approx(expected, rel=1e-12)
        assert area(ring + FAR) == pytest.approx(expected, abs=1e-5)
    assert [area(SQUARE[:count]) for count in (0, 1, 2)] == [0.0, 0.0, 0.0]


@given(st.floats(-math.pi, math.pi), st.floats(0.5, 20.0), st.floats(1.0, 300.0))
def test_a_straight_strip_is_a_rectangle_of_its_width(
    heading: float, width: float, length: float
) -> None:
    """Its right side first, to the end; then its left side, back."""
    along = np.array([math.cos(heading), math.sin(heading)])
    right = 0.5 * width * np.array([along[1], -along[0]])
    line = np.array([np.zeros(2), 0.4 * length * along, 0.4 * length * along, length * along])
    found = strip(line, width)
    assert found.shape == (6, 2)  # of the two equal points one
    np.testing.assert_allclose(found[[0, 2]], [right, length * along + right], atol=1e-9)
    np.testing.assert_allclose(found[[3, 5]], [length * along - right, -right], atol=1e-9)
    assert area(found) == pytest.approx(width * length, rel=1e-9)


def test_a_bend_of_ninety_degrees_is_mitred() -> None:
    """To the left: the outer corner is on the right side."""
    line = np.array([(0.0, 0.0), (10.0, 0.0), (10.0, 10.0)])
    expected = [(0.0, -2.0), (12.0, -2.0), (12.0, 10.0), (8.0, 10.0), (8.0, 2.0), (0.0, 2.0)]
    np.testing.assert_allclose(strip(line, 4.0), expected, atol=1e-12)


@pytest.mark.parametrize("degrees", [90.0, 138.0, 140.0, 170.0, 179.9])
def test_the_mitre_of_a_sharper_bend_than_139_degrees_shrinks(degrees: float) -> None:
    """Up to there it is half the width by the cosine of half the bend, beyond never longer."""
    bend = math.radians(degrees)
    line = np.array([(-50.0, 0.0), (0.0, 0.0), (50.0 * math.cos(bend), 50.0 * math.sin(bend))])
    mitre = float(np.hypot(*strip(line, 4.0)[1]))
    full = 2.0 / math.cos(0.5 * bend)
    assert mitre == pytest.approx(
        full if degrees < 139.0 else 16.0 * math.cos(0.5 * bend), rel=1e-9
    )
    assert mitre <= 2.0 / math.cos(0.5 * math.acos(-0.75)) + 1e-9


@pytest.mark.parametrize("line", [SQUARE[:1], np.vstack([SQUARE[:1], SQUARE[:1]])])
def test_a_line_of_one_point_has_no_strip(line: Float) -> None:
    assert strip(line, 3.0).shape == (0, 2)


def test_rings_are_joined_in_their_order_and_nobody_can_write_to_them() -> None:
    rings = [SQUARE, SQUARE[:3] + 20.0]
    road, buildings = RoadSurface.of(rings), Buildings.of(rings, [5.0, 7.5])
    for found in (road, buildings):
        np.testing.assert_array_equal(found.vertex, np.vstack(rings))
        assert found.index.tolist() == [0, 0, 0, 0, 1, 1, 1]
        assert found.index.dtype == np.int32
        assert not found.vertex.flags.writeable
        assert not found.index.flags.writeable
    assert buildings.height.tolist() == [5.0, 7.5]
    assert not buildings.height.flags.writeable
    assert RoadSurface.of([]).vertex.shape == (0, 2)
