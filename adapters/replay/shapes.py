"""Shapes as SUMO writes them: points in the plane, one after the other."""

from typing import Final

import numpy as np

from adapters.traffic.geometry import Float

_SAME_POINT: Final = 0.01
"""Vertices closer than this [m] are one: SUMO writes coordinates with two decimals."""


def read_shape(text: str) -> Float | None:
    """Points [m], shape (point, 2), of a text as `0,0 10,0 10,5`; heights are left out.

    Returns:
        `None` if the text is something else.
    """
    try:
        points = [[float(x) for x in point.split(",")[:2]] for point in text.split()]
        shape = np.array(points, dtype=float).reshape(len(points), 2)
    except ValueError:
        return None
    return shape if np.isfinite(shape).all() else None


def open_ring(ring: Float) -> Float:
    """`ring`, shape (vertex, 2), without a last vertex that repeats the first."""
    closes = len(ring) > 1 and bool(np.hypot(*(ring[0] - ring[-1])) < _SAME_POINT)
    return ring[:-1] if closes else ring
