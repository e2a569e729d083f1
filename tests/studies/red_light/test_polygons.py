"""Distances of convex polygons."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given, strategies as st

from studies.red_light.polygons import polygon_distance


@given(st.floats(-20, 20), st.floats(-20, 20), st.floats(0, 2 * np.pi), st.floats(0, 2 * np.pi))
def test_polygon_distance_is_symmetric_and_invariant(
    x: float, y: float, turn: float, rotation: float
) -> None:
    box = np.array([[2.0, 1], [-2, 1], [-2, -1], [2, -1]])

    def rotated(points: Any, angle: float) -> Any:
        cos, sin = np.cos(angle), np.sin(angle)
        return points @ np.array([[cos, sin], [-sin, cos]])

    other = rotated(box, turn) + np.array([x, y])
    distance = polygon_distance(box, other)
    assert polygon_distance(other, box) == pytest.approx(distance, abs=1e-9)
    moved = polygon_distance(rotated(box, rotation), rotated(other, rotation))
    assert moved == pytest.approx(distance, abs=1e-9)
    assert distance <= max(np.hypot(x, y), 0.0)
