"""Lines of sight in the plane."""

import numpy as np
import numpy.typing as npt

Float = npt.NDArray[np.float64]
Bool = npt.NDArray[np.bool_]


def cut(start: Float, end: Float, polygon: Float) -> Bool:
    """Whether the segments from `start` to `end`, (n, 2) each, meet an edge of `polygon`, (n,)."""
    way = (end - start)[:, None]
    edge = (np.roll(polygon, -1, axis=0) - polygon)[None]
    apart = polygon[None] - start[:, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        determinant = way[..., 0] * edge[..., 1] - way[..., 1] * edge[..., 0]
        t = (apart[..., 0] * edge[..., 1] - apart[..., 1] * edge[..., 0]) / determinant
        u = (apart[..., 0] * way[..., 1] - apart[..., 1] * way[..., 0]) / determinant
    return np.asarray(((t >= 0) & (t <= 1) & (u >= 0) & (u <= 1)).any(axis=1))
