"""Boxes of `OBJECT` records by their corners along the world's axes."""

import numpy as np

from fmus.physics.boxes import corners
from orchestrator.signal import Array


def put(records: Array, low: object, high: object) -> None:
    """Give records boxes along the axes, from `low` to `high` [m], shape (..., 2) both."""
    low, high = np.asarray(low, np.float64), np.asarray(high, np.float64)
    records["position"], records["size"], records["angle"] = (low + high) / 2, high - low, 0.0


def bounds(records: Array) -> tuple[Array, Array]:
    """The lower and upper corners of the boxes along the axes around boxes [m], (..., 2) both."""
    found = corners(records["position"], records["angle"], records["size"])
    return found.min(axis=-2), found.max(axis=-2)
