"""The squares that a request asks about, and what of a sharer's scan lies in them."""

import math
from dataclasses import dataclass
from fractions import Fraction
from typing import Final

import numpy as np

from fmus.facilities.inputs import BlindZones
from fmus.messages.apm import Apm
from fmus.physics.boxes import Boxes
from orchestrator.signal import Array

ZONE_SIZE: Final = 12
"""Size of one zone in a request [byte]: centre and range in single precision."""

_RESOLUTION: Final = 0.5
"""Largest side of a sub-cell [m]; that of the perception unit's `region_resolution`."""
_MOST_SUB_CELLS: Final = 100
"""Sub-cells along one side of a cell, at most."""
_SHIFT: Final = 1e-7
"""Shift of the squares along both axes [m]. Centres of sub-cells often lie on the border of a
square, when the two vehicles' grids are aligned; away from it, rounding errors decide nothing."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Zones:
    """Blind zones of the ego vehicle as a request says them: squares along its heading.

    Attributes:
        heading: along which the squares are turned, counter-clockwise from east [rad].
        centers: world frame [m], float64, shape (zone, 2).
        ranges: half the sides [m], float64, shape (zone,), positive.
    """

    heading: float
    centers: Array
    ranges: Array

    def __len__(self) -> int:
        return len(self.ranges)

    def reached_by(self, boxes: Boxes) -> Array:
        """Whether boxes overlap or touch a zone.

        Args:
            boxes: in the world frame, of shape (box,).

        Returns:
            Whether each box does, bool, shape (box,).
        """
        side = 2.0 * self.ranges[:, None]
        each = Boxes(boxes.center[:, None], boxes.heading[:, None], boxes.size[:, None])
        squares = Boxes(self.centers, np.array(self.heading), np.hstack([side, side]))
        return np.asarray(each.overlap(squares).any(axis=-1))  # of (box, zone)

    def share_of(self, apm: Apm) -> Fraction:
        """The share of a matrix's index that lies in the union of the zones.

        With the paper's index, which counts points, it is the share of the points, taken as
        evenly spread within each cell. A cell is divided into sub-cells of at most 0.5 m, each
        of which is in the union if its centre is. So the share is additive over disjoint zones
        and monotonic, exactly; the area in one cell is right to about half a sub-cell times the
        length of the border in it.

        Args:
            apm: a sharer's.

        Returns:
            0 to 1; 0 if the matrix is empty.
        """
        total = int(apm.cells.sum(dtype=np.uint64))
        occupied = np.argwhere(apm.cells)
        side = min(max(math.ceil(apm.cell / _RESOLUTION), 1), _MOST_SUB_CELLS)
        inside = np.zeros((len(occupied), side * side), np.bool_)
        sub_centers = (np.moveaxis(np.indices((side, side)), 0, -1).reshape(-1, 2) + 0.5) / side
        cell_centers = apm.world(occupied + 0.5)
        for center, half in zip(self.centers, self.ranges, strict=True):
            reach = math.sqrt(2.0) * (half + apm.cell)
            (near,) = np.nonzero((np.abs(cell_centers - center) <= reach).all(axis=-1))
            offset = apm.world(occupied[near, None] + sub_centers) - center
            turned = self._turned(offset) + _SHIFT
            inside[near] |= ((turned >= -half) & (turned < half)).all(axis=-1)
        index = apm.cells[occupied[:, 0], occupied[:, 1]].astype(np.uint64)
        wanted = int((index * inside.sum(axis=1, dtype=np.uint64)).sum())
        return Fraction(wanted, max(total, 1) * side * side)

    def _turned(self, offset: Array) -> Array:
        """World offsets along the heading and to the left of it; shape (..., 2) both."""
        cosine, sine = math.cos(self.heading), math.sin(self.heading)
        x, y = offset[..., 0], offset[..., 1]
        return np.stack([x * cosine + y * sine, y * cosine - x * sine], axis=-1)


NOWHERE: Final = Zones(heading=0.0, centers=np.empty((0, 2)), ranges=np.empty(0))
"""No zones."""


def zones_in(blind_zones: BlindZones, heading: float) -> Zones:
    """The zones in use, rounded to single precision as on the air.

    Args:
        blind_zones: where the ego is blind.
        heading: that the ego vehicle believed to have in the scan with these zones [rad].

    Raises:
        ValueError: the inputs `blind_zone.*` are not connected, or are no zones.
    """
    centers, ranges = blind_zones.centers, blind_zones.ranges
    if len(ranges) == 0:
        raise ValueError(
            "`blind_zone` has no entries, so `answer: demanded` can ask for nothing: connect "
            "{from: perception.blind_zone, to: facilities.blind_zone}, or choose `answer: all`"
        )
    if len(centers) != len(ranges):
        raise ValueError(
            f"`blind_zone.center` has {len(centers)} entries, `blind_zone.range` {len(ranges)}"
        )
    usable = np.isfinite(ranges) & (ranges >= 0.0)
    usable &= np.isfinite(centers).all(axis=-1) | (ranges == 0.0)
    if not usable.all():
        worst = int(np.argmin(usable))
        raise ValueError(
            f"`blind_zone` {worst} has the centre {centers[worst].tolist()} and the range "
            f"{float(ranges[worst])}; both must be finite, and the range >= 0"
        )
    used = ranges > 0.0
    return Zones(
        heading=float(np.float32(heading)),
        centers=centers[used].astype(np.float32).astype(np.float64),
        ranges=ranges[used].astype(np.float32).astype(np.float64),
    )
