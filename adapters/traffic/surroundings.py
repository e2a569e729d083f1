"""What stands around: buildings, and the drivable surface of strips along lanes and junctions."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from adapters.traffic.geometry import Float

SAME_POINT: Final = 0.01
"""Vertices closer than this [m] are one: SUMO writes coordinates with two decimals."""

THIN: Final = 1e-3
"""An area [m^2] below this is none: corners on a line, or an outline that crosses itself."""

_SHARPEST_MITRE: Final = 0.25
"""Smallest 1 + cos of a bend's angle that is mitred in full: up to 139 degrees."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RoadSurface:
    """Polygons that together are the drivable surface; they may overlap. The arrays are read-only.

    Attributes:
        vertex: corners, open rings one after the other [m], shape (vertex, 2).
        index: the polygon each corner belongs to, int32, shape (vertex,).
    """

    vertex: Float
    index: npt.NDArray[np.int32]

    @classmethod
    def of(cls, rings: Sequence[Float]) -> "RoadSurface":
        """The surface of polygons, open rings of shape (vertex, 2) each."""
        vertex, index = _joined(rings)
        return cls(vertex=vertex, index=index)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Buildings:
    """All buildings; the arrays are read-only.

    Attributes:
        vertex: corners, open rings one after the other [m], shape (vertex, 2).
        index: the building each corner belongs to, int32, shape (vertex,).
        height: above the ground [m], shape (building,).
    """

    vertex: Float
    index: npt.NDArray[np.int32]
    height: Float

    @classmethod
    def of(cls, rings: Sequence[Float], heights: Sequence[float]) -> "Buildings":
        """Buildings with these outlines, shape (vertex, 2) each, and heights [m]."""
        vertex, index = _joined(rings)
        height = np.array(heights, dtype=np.float64)
        height.flags.writeable = False
        return cls(vertex=vertex, index=index, height=height)


def open_ring(ring: Float) -> Float:
    """`ring`, shape (vertex, 2), without a last vertex that repeats the first."""
    closes = len(ring) > 1 and bool(np.hypot(*(ring[0] - ring[-1])) < SAME_POINT)
    return ring[:-1] if closes else ring


def area(ring: Float) -> float:
    """The area of a simple polygon [m^2]; 0 with fewer than three corners (Gauss's formula).

    Args:
        ring: corners [m], an open ring, shape (corner, 2).
    """
    x, y = (ring - ring[:1]).T
    return abs(0.5 * float((x * np.roll(y, -1) - np.roll(x, -1) * y).sum()))


def strip(line: Float, width: float) -> Float:
    """The outline of a strip along a polyline: its right side, then its left side backwards.

    Args:
        line: points [m], shape (point, 2); neighbours may be equal.
        width: [m].

    Returns:
        Corners [m], shape (2 p, 2) with p the number of different points, none if p is 1; bends are
        mitred.
    """
    line = line[np.concatenate([[True], np.any(np.diff(line, axis=0) != 0.0, axis=1)])]
    if len(line) < 2:
        return np.zeros((0, 2))
    along = np.diff(line, axis=0)
    along /= np.hypot(along[:, 0], along[:, 1])[:, None]
    left = np.column_stack([-along[:, 1], along[:, 0]])
    before, behind = np.vstack([left[:1], left]), np.vstack([left, left[-1:]])
    # the sum of both normals points along the mitre, which is longer by 1 / cos(half the bend)
    bend = 1.0 + (before * behind).sum(axis=1)
    offset = 0.5 * width * (before + behind) / np.maximum(bend, _SHARPEST_MITRE)[:, None]
    return np.concatenate([line - offset, (line + offset)[::-1]])


def _joined(rings: Sequence[Float]) -> tuple[Float, npt.NDArray[np.int32]]:
    """Open rings one after the other, and which of them each corner belongs to; read-only."""
    vertex = np.concatenate([np.zeros((0, 2)), *rings])
    index = np.repeat(np.arange(len(rings), dtype=np.int32), [len(ring) for ring in rings])
    vertex.flags.writeable = index.flags.writeable = False
    return vertex, index
