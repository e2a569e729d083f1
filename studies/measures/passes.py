"""Which points of a grid the bodies of vehicles cover, from when until when."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np

from orchestrator.recording.reader import Recording
from orchestrator.signal import Array
from studies.measures.vehicles import Vehicles

_CHUNK: Final = 2_000_000
"""Points that are looked at together."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Passes:
    """Bodies over points: each from when the point is first covered until it is free again.

    Attributes:
        cell: the point, one number for both coordinates, shape (pass,).
        vehicle: whose body it is, shape (pass,).
        enter: when it arrives [s], shape (pass,).
        leave: when it has left [s], shape (pass,).
        heading_enter: its heading when it arrives [rad], shape (pass,).
        heading_leave: its heading when it leaves [rad], shape (pass,).
        z: height of the ground under it [m], shape (pass,).
        spacing: of the grid [m].
        too_fast: how often a vehicle went farther between two communication points than it is long;
            points between may be missing.
    """

    cell: Array
    vehicle: Array
    enter: Array
    leave: Array
    heading_enter: Array
    heading_leave: Array
    z: Array
    spacing: float
    too_fast: int

    def places(self, rows: Array) -> tuple[Array, Array]:
        """The points of some passes, east and north [m], shape (n,) each."""
        x = self.cell[rows] >> 32
        y = self.cell[rows] - (x << 32)
        return x * self.spacing, (y - _MIDDLE) * self.spacing


_MIDDLE: Final = 1 << 31
"""Added to the northward number of a point, so that it is not negative."""


@dataclass(frozen=True, slots=True, kw_only=True)
class _Stays:
    """Bodies that stand or are looked at once: rows of vehicles, by vehicle and time.

    Attributes:
        row: of the vehicles, shape (stay,).
        begin, end: the first and the last communication point of it [s].
        before, after: since the stay before, until the next one of the same vehicle [s]; 0 where
            there is none.
        moved_before, moved_after: what the body moved in this time, in its own frame [m], shape
            (stay, 2).
        number: consecutive within a vehicle; a gap where it was away.
    """

    row: Array
    begin: Array
    end: Array
    before: Array
    after: Array
    moved_before: Array
    moved_after: Array
    number: Array


def passes_of(recording: Recording, vehicles: Vehicles, vehicle: str, spacing: float) -> Passes:
    """Find all passes.

    Args:
        recording: of a run.
        vehicles: all of them.
        vehicle: what the names of their signals begin with.
        spacing: of the grid [m].
    """
    heading = vehicles.values(recording, f"{vehicle}.heading")
    size = vehicles.values(recording, f"{vehicle}.size")
    stays = _stays(vehicles, heading)
    length = size[stays.row, 0]
    too_fast = int((np.hypot(*stays.moved_before.T) > length).sum())
    found = [
        _covered(vehicles, heading, size, stays, chunk=chunk, spacing=spacing)
        for chunk in _chunks(np.hypot(size[stays.row, 0], size[stays.row, 1]), spacing)
    ]
    stay = np.concatenate([np.empty(0, np.int64), *(each[0] for each in found)])
    cell = np.concatenate([np.empty(0, np.int64), *(each[1] for each in found)])
    enter = np.concatenate([np.empty(0), *(each[2] for each in found)])
    leave = np.concatenate([np.empty(0), *(each[3] for each in found)])
    ids = vehicles.ids[stays.row]
    order = np.lexsort((stays.number[stay], ids[stay], cell))
    stay, cell, enter, leave = stay[order], cell[order], enter[order], leave[order]
    goes_on = (cell[1:] == cell[:-1]) & (ids[stay[1:]] == ids[stay[:-1]])
    goes_on &= stays.number[stay[1:]] == stays.number[stay[:-1]] + 1
    first = np.flatnonzero(np.concatenate([[True], ~goes_on])[: len(stay)])
    last = np.concatenate([first[1:] - 1, [len(stay) - 1]])[: len(first)]
    rows = stays.row[stay]
    return Passes(
        cell=cell[first],
        vehicle=ids[stay[first]],
        enter=enter[first],
        leave=leave[last],
        heading_enter=heading[rows[first]],
        heading_leave=heading[rows[last]],
        z=vehicles.position[rows[first], 2],
        spacing=spacing,
        too_fast=too_fast,
    )


def _stays(vehicles: Vehicles, heading: Array) -> _Stays:
    """Rows of vehicles by vehicle and time; those that stand still together."""
    order = np.lexsort((vehicles.points, vehicles.ids))
    ids, points = vehicles.ids[order], vehicles.points[order]
    place = vehicles.position[order, :2]
    follows = (ids[1:] == ids[:-1]) & (points[1:] == points[:-1] + 1)
    stands = follows & (place[1:] == place[:-1]).all(axis=1)
    stands &= heading[order[1:]] == heading[order[:-1]]
    first = np.flatnonzero(np.concatenate([[True], ~stands])[: len(order)])
    last = np.concatenate([first[1:] - 1, [len(order) - 1]])[: len(first)]
    seconds = vehicles.times / 1e9
    begin, end = seconds[points[first]], seconds[points[last]]
    goes_on = follows[first[1:] - 1]
    gap = np.where(goes_on, begin[1:] - end[:-1], 0.0)
    moved = np.where(goes_on[:, None], place[first[1:]] - place[first[:-1]], 0.0)
    none, still = np.zeros(1)[: len(first)], np.zeros((1, 2))[: len(first)]
    row = order[first]
    return _Stays(
        row=row,
        begin=begin,
        end=end,
        before=np.concatenate([none, gap]),
        after=np.concatenate([gap, none]),
        moved_before=_own_frame(np.concatenate([still, moved]), heading[row]),
        moved_after=_own_frame(np.concatenate([moved, still]), heading[row]),
        number=np.arange(len(first)) + np.concatenate([none, np.cumsum(~goes_on)]).astype(np.int64),
    )


def _own_frame(vectors: Array, heading: Array) -> Array:
    """Vectors in the frame of bodies: along their lengths, to their left; shape (n, 2)."""
    cosine, sine = np.cos(heading), np.sin(heading)
    x, y = vectors[:, 0], vectors[:, 1]
    return np.stack([cosine * x + sine * y, cosine * y - sine * x], axis=1)


def _chunks(diagonal: Array, spacing: float) -> Iterator[tuple[Array, int]]:
    """Stays whose bodies fit into squares of as many points, and how many a side has."""
    side = np.ceil(diagonal / spacing).astype(np.int64) + 1
    for points in np.unique(side).tolist():
        members = np.flatnonzero(side == points)
        step = max(1, _CHUNK // points**2)
        for start in range(0, len(members), step):
            yield members[start : start + step], points


def _covered(
    vehicles: Vehicles,
    heading: Array,
    size: Array,
    stays: _Stays,
    *,
    chunk: tuple[Array, int],
    spacing: float,
) -> tuple[Array, Array, Array, Array]:
    """The points under some bodies: stay, point, when it was reached and when it is free [s]."""
    members, side = chunk
    rows = stays.row[members]
    center = vehicles.position[rows, :2]
    corner = np.floor(center / spacing - (side - 1) / 2).astype(np.int64) + 1
    grid = np.stack(np.meshgrid(np.arange(side), np.arange(side), indexing="ij"), -1).reshape(-1, 2)
    points = corner[:, None, :] + grid
    local = _own_frame(
        (points * spacing - center[:, None, :]).reshape(-1, 2), np.repeat(heading[rows], side**2)
    ).reshape(points.shape)
    half = size[rows, None, :2] / 2
    which, where = np.nonzero((np.abs(local) < half).all(axis=2))
    stay, inside, half = members[which], local[which, where], half[which, 0]
    cell = (points[which, where, 0] << 32) + points[which, where, 1] + _MIDDLE
    since = _time_inside(inside, stays.moved_before[stay], stays.before[stay], half)
    until = _time_inside(inside, -stays.moved_after[stay], stays.after[stay], half)
    return stay, cell, stays.begin[stay] - since, stays.end[stay] + until


def _time_inside(local: Array, moved: Array, duration: Array, half: Array) -> Array:
    """How long points that move through boxes stay inside, at most `duration` [s].

    Args:
        local: where they are, in the frames of the boxes [m], shape (n, 2).
        moved: how they move in `duration` [m], shape (n, 2).
        duration: [s], shape (n,).
        half: half the sizes of the boxes [m], shape (n, 2).
    """
    moves = moved != 0.0
    way = np.where(moved > 0.0, half - local, half + local)
    share = np.where(moves, way / np.where(moves, np.abs(moved), 1.0), np.inf).min(axis=1)
    return np.asarray(np.minimum(share, 1.0) * duration)
