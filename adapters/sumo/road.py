"""The drivable surface: lanes of passenger cars with their widths, and junctions."""

from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from adapters.sumo.scene import area, frozen, open_ring
from adapters.sumo.simulation import Sumo
from adapters.traffic.geometry import Float

_SHARPEST_MITRE: Final = 0.25
"""Smallest 1 + cos of a bend's angle that is mitred in full: up to 139 degrees."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Road:
    """Polygons that together are the drivable surface; they may overlap. The arrays are read-only.

    Attributes:
        vertex: corners, open rings one after the other [m], shape (vertex, 2).
        index: the polygon each corner belongs to, int32, shape (vertex,).
    """

    vertex: Float
    index: npt.NDArray[np.int32]


def read_road(sumo: Sumo) -> Road:
    """Lanes outside junctions that passenger cars may use, and the junctions at their ends.

    Ordered by name, lanes first. Lanes inside junctions are left out: they lie within the
    junction's own polygon.
    """
    lanes = [lane for lane in sumo.lanes() if sumo.allows(lane, "passenger")]
    junctions = {end for lane in lanes for end in sumo.ends_of(sumo.edge_of(lane))}
    strips = (strip(sumo.lane_shape(lane), sumo.lane_width(lane)) for lane in lanes)
    rings = [ring for ring in strips if len(ring)]
    for junction in sorted(junctions):
        ring = open_ring(sumo.junction_shape(junction))
        if area(ring) > 0.0:  # a dead end has none
            rings.append(ring)
    index = np.repeat(np.arange(len(rings), dtype=np.int32), [len(ring) for ring in rings])
    return Road(vertex=frozen(np.concatenate([np.zeros((0, 2)), *rings])), index=frozen(index))


def strip(line: Float, width: float) -> Float:
    """The outline of a strip along a polyline: its right side, then its left side backwards.

    Args:
        line: points [m], shape (point, 2); neighbours may be equal.
        width: [m].

    Returns:
        Corners [m], shape (2 p, 2) with p the number of different points, none if p is 1; bends are
        mitred.
    """
    line = line[np.concatenate([[True], np.any(np.diff(line, axis=0) != 0.0, axis=1)])]
    if len(line) < 2:
        return np.zeros((0, 2))
    along = np.diff(line, axis=0)
    along /= np.hypot(along[:, 0], along[:, 1])[:, None]
    left = np.column_stack([-along[:, 1], along[:, 0]])
    before, behind = np.vstack([left[:1], left]), np.vstack([left, left[-1:]])
    # the sum of both normals points along the mitre, which is longer by 1 / cos(half the bend)
    bend = 1.0 + (before * behind).sum(axis=1)
    offset = 0.5 * width * (before + behind) / np.maximum(bend, _SHARPEST_MITRE)[:, None]
    return np.concatenate([line - offset, (line + offset)[::-1]])
