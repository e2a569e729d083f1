"""Rotations as quaternions."""

import numpy as np

from orchestrator.signal import Array


def quaternion(
    heading: Array | float, pitch: Array | float = 0.0, roll: Array | float = 0.0
) -> Array:
    """A rotation by roll about x, then pitch about y, then heading about z.

    Args:
        heading: counter-clockwise from x [rad], any shape.
        pitch: nose down positive [rad], likewise.
        roll: right side down positive [rad], likewise.

    Returns:
        x, y, z, w, of the shape of the angles and 4.
    """
    angles = np.broadcast_arrays(heading, pitch, roll)
    (cz, sz), (cy, sy), (cx, sx) = ((np.cos(angle / 2), np.sin(angle / 2)) for angle in angles)
    parts = (
        cz * cy * sx - sz * sy * cx,
        cz * sy * cx + sz * cy * sx,
        sz * cy * cx - cz * sy * sx,
        cz * cy * cx + sz * sy * sx,
    )
    return np.stack(parts, axis=-1)
