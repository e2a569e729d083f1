"""Oriented boxes in the plane: the footprints of vehicles' bodies."""

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
    apart_a, distance_a = _outside(a, b)
    apart_b, distance_b = _outside(b, a)
    return np.where(apart_a | apart_b, np.minimum(distance_a, distance_b), 0.0)


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
    """The same angles [rad] in [-pi, pi)."""
    return (angle + np.pi) % (2.0 * np.pi) - np.pi


def _outside(a: Boxes, b: Boxes) -> tuple[npt.NDArray[np.bool_], Float]:
    """Whether an edge of `a` separates the boxes; smallest distance of a corner of `b` to `a`."""
    local = rotate(b.corners() - a.center[..., None, :], -a.heading[..., None])
    half = 0.5 * a.size
    beyond = np.maximum(np.abs(local) - half[..., None, :], 0.0)
    distance = np.sqrt((beyond * beyond).sum(axis=-1).min(axis=-1))
    separates = (local.min(axis=-2) > half) | (local.max(axis=-2) < -half)
    return separates.any(axis=-1), distance
