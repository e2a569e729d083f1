"""Oriented boxes in the plane: the footprints of bodies."""

from dataclasses import dataclass
from typing import Final, Self

import numpy as np

from orchestrator.signal import Array

SIGNS: Final = np.array([[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]])
"""Signs of x and y at the corners of a box in its own frame, in the order of `corners`."""


def corners(center: Array, heading: Array, size: Array) -> Array:
    """The corners of boxes: front left, rear left, rear right, front right.

    The arguments' shapes broadcast, without the last axis of `center` and `size`.

    Args:
        center: middle of each box [m], shape (..., 2).
        heading: direction of its length, counter-clockwise from east [rad], shape (...).
        size: its length and width [m], shape (..., 2).

    Returns:
        Corners [m], shape (..., 4, 2), counter-clockwise.
    """
    local = 0.5 * size[..., None, :] * SIGNS
    cos, sin = np.cos(heading)[..., None], np.sin(heading)[..., None]
    x, y = local[..., 0], local[..., 1]
    turned = np.stack([cos * x - sin * y, sin * x + cos * y], axis=-1)
    return np.asarray(center[..., None, :] + turned)


@dataclass(frozen=True, slots=True, eq=False)
class Boxes:
    """Oriented boxes, whose shapes broadcast.

    Attributes:
        center: middle of each box [m], shape (..., 2).
        heading: direction of its length, counter-clockwise from east [rad], shape (...).
        size: its length and width [m], shape (..., 2).
    """

    center: Array
    heading: Array
    size: Array

    def overlap(self, other: Self) -> Array:
        """Whether boxes overlap or touch others, with whose shapes theirs broadcast.

        Two rectangles are apart iff a side of one separates them (separating axis theorem).

        Returns:
            A mask, bool, shape (...).
        """
        offset, turned = other.center - self.center, other.heading - self.heading
        cosine, sine = np.abs(np.cos(turned)), np.abs(np.sin(turned))
        apart = np.zeros(1, np.bool_)
        for own, far in ((self, other), (other, self)):
            cos, sin = np.cos(own.heading), np.sin(own.heading)
            along = np.abs(cos * offset[..., 0] + sin * offset[..., 1])
            across = np.abs(cos * offset[..., 1] - sin * offset[..., 0])
            length, width = far.size[..., 0], far.size[..., 1]
            apart = apart | (along > (own.size[..., 0] + cosine * length + sine * width) / 2)
            apart = apart | (across > (own.size[..., 1] + sine * length + cosine * width) / 2)
        return np.asarray(~apart)


def in_boxes(points: Array, center: Array, heading: Array) -> Array:
    """Points in the frames of boxes: x along the length of each, y to its left.

    Args:
        points: places [m], shape (..., 2), which broadcasts against the boxes.
        center: middle of each box [m], shape (..., box, 2).
        heading: direction of its length, counter-clockwise from east [rad], shape (..., box).

    Returns:
        Places in each frame [m], shape (..., box, 2).
    """
    offset = points - center
    cos, sin = np.cos(heading), np.sin(heading)
    along = cos * offset[..., 0] + sin * offset[..., 1]
    across = -sin * offset[..., 0] + cos * offset[..., 1]
    return np.stack([along, across], axis=-1)
