"""Oriented boxes against Shapely's polygons."""

import numpy as np
import pytest
from hypothesis import given, strategies as st

from fmus.physics.boxes import Boxes, corners, in_boxes
from orchestrator.signal import Array

shapely = pytest.importorskip("shapely")

LENGTHS = st.floats(0.01, 12.0)
ANGLES = st.floats(-7.0, 7.0)
PLACES = st.floats(-15.0, 15.0)
ONE = st.tuples(PLACES, PLACES, ANGLES, LENGTHS, LENGTHS)


def some(*rows: tuple[float, float, float, float, float]) -> Boxes:
    table = np.array(rows)
    return Boxes(table[:, :2], table[:, 2], table[:, 3:])


def polygons(boxes: Boxes) -> Array:
    found: Array = shapely.polygons(corners(boxes.center, boxes.heading, boxes.size))
    return found


@given(st.lists(ONE, min_size=1, max_size=5), st.lists(ONE, min_size=1, max_size=5))
def test_boxes_overlap_where_their_polygons_do(
    first: list[tuple[float, float, float, float, float]],
    second: list[tuple[float, float, float, float, float]],
) -> None:
    """All pairs at once; what touches to a hair may be either."""
    own, other = some(*first), some(*second)
    pairs = polygons(own)[:, None], polygons(other)
    gaps, common = shapely.distance(*pairs), shapely.area(shapely.intersection(*pairs))
    each = Boxes(own.center[:, None], own.heading[:, None], own.size[:, None])
    found = each.overlap(other)
    assert found.shape == (len(first), len(second))
    assert (found | (common < 1e-9)).all()
    assert (~found | (gaps < 1e-9)).all()
    back = Boxes(other.center[:, None], other.heading[:, None], other.size[:, None])
    np.testing.assert_array_equal(back.overlap(own).T, found)


@given(ONE, st.floats(0.0, 1.0), st.floats(0.0, 1.0))
def test_a_place_in_the_frame_of_a_box_is_where_its_corners_say(
    row: tuple[float, float, float, float, float], along: float, across: float
) -> None:
    """Between the corners as between the ends of the box."""
    box = some(row)
    front_left, rear_left, _, front_right = corners(box.center, box.heading, box.size)[0]
    place = front_left + along * (rear_left - front_left) + across * (front_right - front_left)
    (local,) = in_boxes(place[None], box.center, box.heading)
    expected = box.size[0] * (0.5 - np.array([along, across]))
    np.testing.assert_allclose(local, expected, atol=1e-9)
