"""The box around a part of the route holds all that a projection puts there."""

import numpy as np
from hypothesis import given, strategies as st

from fmus.driving.policy.route import Segments

coordinate = st.floats(-50, 50)
place = st.tuples(coordinate, coordinate)


@given(
    st.lists(place, min_size=2, max_size=5, unique=True),
    st.lists(place, min_size=1, max_size=30),
    coordinate,
    st.floats(0, 80),
    st.floats(0, 20),
)
def test_nothing_of_the_stretch_is_outside_of_its_box(
    route: list[tuple[float, float]],
    points: list[tuple[float, float]],
    first: float,
    length: float,
    side: float,
) -> None:
    segments = Segments.of(np.array(route))
    box = segments.box(first, first + length, side)
    along, across = segments.project(np.array(points))
    there = (first <= along) & (along <= first + length) & (np.abs(across) <= side)
    inside = ((box.lower <= points) & (points <= box.upper)).all(axis=1)
    assert np.all(inside | ~there)


def test_the_box_follows_the_bend_and_is_no_larger() -> None:
    segments = Segments.of(np.array([[0.0, 0.0], [10.0, 0.0], [10.0, 30.0]]))
    box = segments.box(-5.0, 14.0, 1.0)
    np.testing.assert_allclose(box.lower, [-6.0, -1.0], atol=0.02)
    np.testing.assert_allclose(box.upper, [11.0, 5.0], atol=0.02)
