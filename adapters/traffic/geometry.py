"""Oriented boxes in the plane: the footprints of vehicles' bodies.

`fmus.physics.boxes` has the corners too; adapters and units do not know each other.
"""

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

Float: TypeAlias = npt.NDArray[np.float64]

_SIGNS = np.array([[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]])
"""Front left, rear left, rear right, front right."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Boxes:
    """Any number of boxes; the shapes of the attributes broadcast.

    Attributes:
        center: [m], shape (..., 2).
        heading: of the length axis, counter-clockwise from east [rad], shape (...).
        size: length and width [m], shape (..., 2).
    """

    center: Float
    heading: Float
    size: Float

    def corners(self) -> Float:
        """Front left, rear left, rear right, front right [m], shape (..., 4, 2)."""
        local = 0.5 * self.size[..., None, :] * _SIGNS
        return self.center[..., None, :] + rotate(local, self.heading[..., None])


def box_distance(a: Boxes, b: Boxes) -> Float:
    """Smallest distance between boxes [m], shape (...); 0 if they overlap or touch.

    Two convex polygons are disjoint if and only if the normal of one of their edges separates
    them (separating axis theorem; Gottschalk, Lin and Manocha, SIGGRAPH 1996, section 4), and
    then the distance is attained at a corner of one of them. In the frame of a box, both are
    comparisons with half its size.
    """
    boxes = _stacked(a, b)
    half = 0.5 * boxes.size
    others = boxes.corners()[::-1]  # of each box, those of the other one, shape (2, ..., 4, 2)
    local = rotate(others - boxes.center[..., None, :], -boxes.heading[..., None])
    separates = (local.min(axis=-2) > half) | (local.max(axis=-2) < -half)
    beyond = np.maximum(np.abs(local) - half[..., None, :], 0.0)
    square = (beyond * beyond).sum(axis=-1).min(axis=(0, -1))
    return np.where(separates.any(axis=(0, -1)), np.sqrt(square), 0.0)


def direction(heading: Float) -> Float:
    """Unit vectors, shape (..., 2), at `heading` [rad], counter-clockwise from east."""
    vectors = np.empty((*np.shape(heading), 2))
    np.cos(heading, out=vectors[..., 0])
    np.sin(heading, out=vectors[..., 1])
    return vectors


def rotate(vectors: Float, angle: Float) -> Float:
    """Vectors, shape (..., 2), turned counter-clockwise by `angle` [rad], shape (...)."""
    cos, sin = np.cos(angle), np.sin(angle)
    x, y = vectors[..., 0], vectors[..., 1]
    turned = np.empty((*np.broadcast_shapes(np.shape(x), np.shape(angle)), 2))
    turned[..., 0] = cos * x - sin * y
    turned[..., 1] = sin * x + cos * y
    return turned


def wrap(angle: Float) -> Float:
    """Angles [rad] of any shape, turned by whole circles into [-pi, pi)."""
    return (angle + np.pi) % (2.0 * np.pi) - np.pi


def _stacked(a: Boxes, b: Boxes) -> Boxes:
    """Both in arrays of one shape, (2, ...): NumPy's calls cost more than its loops here."""
    shape = np.broadcast_shapes(
        np.shape(a.heading), a.center.shape[:-1], a.size.shape[:-1],
        np.shape(b.heading), b.center.shape[:-1], b.size.shape[:-1],
    )  # fmt: skip
    center, size = np.empty((2, *shape, 2)), np.empty((2, *shape, 2))
    heading = np.empty((2, *shape))
    for k, box in enumerate((a, b)):
        center[k], heading[k], size[k] = box.center, box.heading, box.size
    return Boxes(center=center, heading=heading, size=size)
