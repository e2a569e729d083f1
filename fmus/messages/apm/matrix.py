"""The abstract perception matrix (APM) as NumPy arrays."""

from dataclasses import dataclass
from typing import Final, TypeAlias

import numpy as np
import numpy.typing as npt

Float: TypeAlias = npt.NDArray[np.float64]
Layer: TypeAlias = npt.NDArray[np.void]

HEIGHT_STEP: Final = 0.05
"""One unit of a layer's `height` [m]."""
VELOCITY_STEP: Final = 0.25
"""One unit of a layer's `vx` and `vy` [m/s]."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Apm:
    """One abstract perception matrix.

    Rows run along the heading from the rear to the front, columns across it from right to left.

    Attributes:
        vehicle: number of the vehicle whose perception it is, the source.
        time: when the scan was taken [ns].
        position: where the source is, world frame [m], shape (2,).
        heading: direction of the row axis, counter-clockwise from east [rad].
        center: centre of the matrix, world frame [m], shape (2,).
        cell: side k of one cell [m]; the message carries it in single precision.
        cells: points in each cell, or the share of its ground that is seen in units of
            1 / `levels`; uint32, shape (rows, columns).
        layer: mobility and height, `APM_LAYER_CELL`, shape (rows, columns); None if not sent.
        levels: index of a cell whose ground is all seen, at most 255; 0 if the cells count points.
    """

    vehicle: int
    time: int
    position: Float
    heading: float
    center: Float
    cell: float
    cells: npt.NDArray[np.uint32]
    layer: Layer | None = None
    levels: int = 0

    def locate(self, points: Float) -> npt.NDArray[np.int64]:
        """Row and column of each world point; outside the matrix they are out of range.

        Args:
            points: world frame [m], shape (..., 2).

        Returns:
            Indices, shape (..., 2); a point on a border belongs to the cell in front or left.
        """
        forward, left = _axes(self.heading)
        offset = np.asarray(points, np.float64) - self.center
        along = np.stack([offset @ forward, offset @ left], axis=-1)
        return np.floor(along / self.cell + np.array(self.cells.shape) / 2).astype(np.int64)

    def world(self, indices: npt.ArrayLike) -> Float:
        """World positions of (fractional) indices; cell (i, j) spans [i, i + 1) x [j, j + 1).

        Args:
            indices: row and column, shape (..., 2); `locate(world(index + 0.5)) == index`.

        Returns:
            World frame [m], shape (..., 2).
        """
        forward, left = _axes(self.heading)
        along = (np.asarray(indices, np.float64) - np.array(self.cells.shape) / 2) * self.cell
        return self.center + along[..., :1] * forward + along[..., 1:] * left

    def cell_centers(self) -> Float:
        """Positions of all cells' centres, world frame [m], shape (rows, columns, 2)."""
        return self.world(np.moveaxis(np.indices(self.cells.shape), 0, -1) + 0.5)

    def contains(self, indices: npt.NDArray[np.int64]) -> npt.NDArray[np.bool_]:
        """Whether cells lie in the matrix.

        Args:
            indices: row and column of each cell, shape (..., 2).

        Returns:
            One Boolean per cell, shape (...).
        """
        below = (indices < np.array(self.cells.shape)).all(axis=-1)
        inside: npt.NDArray[np.bool_] = np.logical_and((indices >= 0).all(axis=-1), below)
        return inside


def layer_height(layer: Layer) -> Float:
    """Height above the ground of the highest object in each cell.

    Args:
        layer: `APM_LAYER_CELL`, any shape.

    Returns:
        Heights [m], of the shape of `layer`; 0 where there is no object.
    """
    return layer["height"] * HEIGHT_STEP


def layer_velocity(layer: Layer) -> Float:
    """Velocity of the highest object in each cell.

    Args:
        layer: `APM_LAYER_CELL`, any shape (...).

    Returns:
        Velocities in the world frame [m/s], shape (..., 2); 0 where there is no object.
    """
    return np.stack([layer["vx"], layer["vy"]], axis=-1) * VELOCITY_STEP


def _axes(heading: float) -> tuple[Float, Float]:
    """Unit vectors forward and to the left of `heading` [rad]."""
    cosine, sine = np.cos(heading), np.sin(heading)
    return np.array([cosine, sine]), np.array([-sine, cosine])
