"""Shapes as SUMO writes them: points in the plane, one after the other."""

import numpy as np

from adapters.traffic.geometry import Float


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
