"""Oriented boxes in the plane: the footprints of bodies."""

from typing import Final

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
