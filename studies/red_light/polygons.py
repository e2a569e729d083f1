"""Distances of convex polygons."""

from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[Any]


def polygon_distance(first: Array, second: Array) -> float:
    """Distance of two convex polygons [m], 0 if they overlap.

    They overlap iff no edge normal of either separates them (separating axis theorem);
    else the distance is that of a corner of one to an edge of the other.

    Args:
        first: counter-clockwise corners [m], shape (corner, 2).
        second: likewise.
    """
    separated = False
    for polygon in (first, second):
        edge = np.roll(polygon, -1, axis=0) - polygon
        normal = np.stack([edge[:, 1], -edge[:, 0]], axis=1)
        a, b = first @ normal.T, second @ normal.T
        separated |= bool(((a.max(0) < b.min(0)) | (b.max(0) < a.min(0))).any())
    if not separated:
        return 0.0
    return min(_corner_to_edge(first, second), _corner_to_edge(second, first))


def _corner_to_edge(corners: Array, polygon: Array) -> float:
    start, edge = polygon, np.roll(polygon, -1, axis=0) - polygon
    offset = corners[:, None, :] - start
    along = (offset * edge).sum(-1) / np.maximum((edge * edge).sum(-1), 1e-12)
    foot = start + np.clip(along, 0.0, 1.0)[..., None] * edge
    return float(np.linalg.norm(corners[:, None, :] - foot, axis=-1).min())
