"""Who is in sight of whom: the truth about positions, sizes and buildings."""

from dataclasses import dataclass
from typing import Final

import numpy as np

from fmus.messages.records import LINKS
from fmus.physics.boxes import corners, in_boxes
from orchestrator.recording.reader import Recording
from orchestrator.signal import Array
from studies.measures.cells import Cells
from studies.measures.vehicles import Vehicles

LOS, NLOSV, NLOSB = (LINKS.index(name) for name in ("LOS", "NLOSv", "NLOSb"))

_SIDE: Final = 20.0
"""Sides of the cells in which walls and bodies are looked for [m]."""
_CLEAR: Final = 1e-3
"""What is not higher than this above the line hides nothing [m]: a car among its equals."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Walls:
    """The walls of all buildings, which do not change in a run.

    Attributes:
        start: one end of each in the plane [m], shape (wall, 2).
        end: the other [m], shape (wall, 2).
        height: of the roof above z = 0 [m], shape (wall,).
        cells: where they are.
    """

    start: Array
    end: Array
    height: Array
    cells: Cells

    @classmethod
    def of(cls, recording: Recording, building: str) -> "Walls":
        """Read them; none if no buildings were recorded.

        Args:
            recording: of a run.
            building: what the names of their signals begin with, `component.connector`.
        """
        names = [f"{building}.{name}" for name in ("vertex", "index", "height")]
        if not all(name in recording and len(recording[name]) for name in names):
            return cls.between(np.empty((0, 2)), np.empty(0, np.int64), np.empty(0))
        return cls.between(*(np.asarray(recording[name][0]) for name in names))

    @classmethod
    def between(cls, vertex: Array, index: Array, height: Array) -> "Walls":
        """The walls of rings of corners.

        Args:
            vertex: corners, ring by ring, open rings [m], shape (corner, 2).
            index: the building of each, shape (corner,).
            height: of the roofs above z = 0 [m], shape (building,).
        """
        ends = np.arange(1, len(index) + 1)
        is_last = np.append(index[1:] != index[:-1], [True])[: len(index)]
        ends[is_last] = np.flatnonzero(np.append([True], is_last)[: len(index)])
        start, end = vertex.reshape(-1, 2), vertex[ends].reshape(-1, 2)
        cells = Cells(np.minimum(start, end), np.maximum(start, end), _SIDE)
        return cls(start=start, end=end, height=height[index], cells=cells)

    def hide(self, a: Array, b: Array) -> Array:
        """Whether a wall stands between two points and is higher than the line there.

        Args:
            a: points, height last [m], shape (pair, 3).
            b: likewise.

        Returns:
            bool, shape (pair,).
        """
        pair, wall = self.cells.along(a[:, :2], b[:, :2])
        way, edge = (b - a)[pair], (self.end - self.start)[wall]
        offset = self.start[wall] - a[pair, :2]
        area = _cross(way, edge)
        is_crossed = area != 0.0
        divisor = np.where(is_crossed, area, 1.0)
        on_way, on_edge = _cross(offset, edge) / divisor, _cross(offset, way) / divisor
        for share in (on_way, on_edge):
            is_crossed &= (share >= 0.0) & (share <= 1.0)
        line = a[pair, 2] + on_way * way[:, 2]
        return _any(pair[is_crossed & (line < self.height[wall] - _CLEAR)], len(a))


@dataclass(frozen=True, slots=True, kw_only=True)
class Bodies:
    """The boxes of all rows of vehicles.

    Attributes:
        vehicles: all of them.
        heading: counter-clockwise from east [rad], shape (row,).
        size: length, width, height [m], shape (row, 3).
    """

    vehicles: Vehicles
    heading: Array
    size: Array

    @classmethod
    def of(cls, recording: Recording, vehicles: Vehicles, vehicle: str) -> "Bodies":
        """Read them; `vehicle` is what the names of their signals begin with."""
        heading = vehicles.values(recording, f"{vehicle}.heading")
        return cls(
            vehicles=vehicles, heading=heading, size=vehicles.values(recording, f"{vehicle}.size")
        )

    def links(self, walls: Walls, present: slice, a: Array, b: Array) -> Array:
        """What is between the roofs of vehicles at one communication point.

        Args:
            walls: of all buildings.
            present: the rows of the communication point.
            a: rows of those who look, shape (pair,).
            b: rows of those who are looked for, shape (pair,).

        Returns:
            `LOS`, `NLOSV` (a body is higher than the line) or `NLOSB` (a wall is), shape (pair,).
        """
        tops = self._tops(present)
        first, second = a - present.start, b - present.start
        link = np.where(self.between(present, a, b) > 0, NLOSV, LOS)
        link[walls.hide(tops[first], tops[second])] = NLOSB
        return link

    def between(self, present: slice, a: Array, b: Array) -> Array:
        """How many third bodies are higher than the line between roofs, int64, shape (pair,).

        Args:
            present: the rows of the communication point.
            a: rows of those who look, shape (pair,).
            b: rows of those who are looked for, shape (pair,).
        """
        tops = self._tops(present)
        first, second = a - present.start, b - present.start
        center, heading = self.vehicles.position[present], self.heading[present]
        half = self.size[present, :2] / 2
        ring = corners(center[:, :2], heading, 2 * half)
        cells = Cells(ring.min(axis=1), ring.max(axis=1), _SIDE)
        pair, body = cells.along(tops[first, :2], tops[second, :2])
        is_third = (body != first[pair]) & (body != second[pair])
        pair, body = pair[is_third], body[is_third]
        start, end = tops[first[pair]], tops[second[pair]]
        inside = [in_boxes(p[:, :2], center[body, :2], heading[body]) for p in (start, end)]
        enter, leave = np.zeros(len(pair)), np.ones(len(pair))
        for axis in (0, 1):
            since, until = _within(inside[0][:, axis], inside[1][:, axis], half[body, axis])
            enter, leave = np.maximum(enter, since), np.minimum(leave, until)
        meets = enter < leave
        pair, body, low, rise = pair[meets], body[meets], start[meets, 2], (end - start)[meets, 2]
        heights = np.sort([low + enter[meets] * rise, low + leave[meets] * rise], axis=0)
        is_low = heights[0] < tops[body, 2] - _CLEAR
        is_between = is_low & (heights[1] > center[body, 2])
        return np.bincount(pair[is_between], minlength=len(first))

    def _tops(self, present: slice) -> Array:
        """The middles of the roofs [m], shape (row, 3)."""
        return self.vehicles.position[present] + [0, 0, 1] * self.size[present, 2:]


def _within(start: Array, end: Array, half: Array) -> tuple[Array, Array]:
    """From which to which share of the way a coordinate is within `half` of 0, shape (n,)."""
    way = end - start
    moves = way != 0.0
    divisor = np.where(moves, way, 1.0)
    shares = np.sort([(-half - start) / divisor, (half - start) / divisor], axis=0)
    stays = np.where(np.abs(start) < half, -np.inf, np.inf)
    return np.where(moves, shares[0], stays), np.where(moves, shares[1], -stays)


def _cross(a: Array, b: Array) -> Array:
    return np.asarray(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])


def _any(numbers: Array, count: int) -> Array:
    found = np.zeros(count, bool)
    found[numbers] = True
    return found
