"""What one turn of a lidar leaves over: where there was something above the ground."""

from dataclasses import dataclass
from typing import Final

import numpy as np

from fmus.driving.network.cloud import Cloud, OfLidar
from orchestrator.signal import Array

CELL: Final = 0.4
"""Side of a cell [m]."""
SIDE: Final = 256
"""Cells along each side; the sensor is in the middle, so they reach 51.2 m."""
LAYERS: Final = (0.3, 1.8)
"""Lower ends of the layers over the ground [m]: what cars have too, what only higher bodies and
buildings have. What is lower is taken for ground, which the model takes for flat."""

_AREA: Final = SIDE * SIDE
_RADIUS: Final = SIDE * CELL / 2.0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Scan(OfLidar):
    """The cells in which a lidar saw something.

    Attributes:
        cells: layer * SIDE^2 + row * SIDE + column, ascending, int32, shape (cell,); rows along
            the heading, columns to the left of it, both from -51.2 m.
    """

    cells: Array

    def centers(self) -> tuple[Array, Array]:
        """Middles of the cells in the sensor's frame: ahead and left [m], shape (cell,) each."""
        place = self.cells % _AREA
        return (
            (place // SIDE - SIDE // 2 + 0.5) * CELL,
            (place % SIDE - SIDE // 2 + 0.5) * CELL,
        )

    def layers(self) -> Array:
        """Layers of the cells, 0 the lower one, shape (cell,)."""
        return self.cells // _AREA


def scan_of(cloud: Cloud) -> Scan:
    """Where a cloud has points above the ground; those that are not finite are nowhere."""
    rows = np.flatnonzero(cloud.z > np.float32(LAYERS[0] - cloud.height))
    x, y, z = cloud.x.take(rows), cloud.y.take(rows), cloud.z.take(rows)
    inside = (np.abs(x) < np.float32(_RADIUS)) & (np.abs(y) < np.float32(_RADIUS))
    x, y, z = x.compress(inside), y.compress(inside), z.compress(inside)
    row = ((x + np.float32(_RADIUS)) * np.float32(1.0 / CELL)).astype(np.int32)
    column = ((y + np.float32(_RADIUS)) * np.float32(1.0 / CELL)).astype(np.int32)
    code = row * SIDE + column + _AREA * (z > np.float32(LAYERS[1] - cloud.height))
    seen = np.zeros(len(LAYERS) * _AREA, np.bool_)
    seen[code.compress((row < SIDE) & (column < SIDE))] = True  # a sum may have been rounded up
    return Scan(
        vehicle=cloud.vehicle,
        time=cloud.time,
        frame=cloud.frame,
        height=cloud.height,
        cells=np.flatnonzero(seen).astype(np.int32),
    )
