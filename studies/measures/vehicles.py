"""Where all vehicles were in a run, in arrays."""

import itertools
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np

from orchestrator.recording.reader import Recording
from orchestrator.signal import Array

ABSENT: Final = -1
"""Stands for the row of a vehicle that is not there."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Vehicles:
    """All vehicles at all communication points: a row for each, by point, then by id.

    Attributes:
        times: the communication points [ns], int64, shape (point,), ascending.
        first: the first row of each point and the end of the last, int64, shape (point + 1,).
        ids: numbers of the vehicles, int64, shape (row,).
        position: middles of the bodies in the plane, and height of the ground [m], shape (row, 3).
    """

    times: Array
    first: Array
    ids: Array
    position: Array
    _order: Array
    _keys: Array

    @property
    def points(self) -> Array:
        """The communication point of every row, as an index into `times`, shape (row,)."""
        return np.repeat(np.arange(len(self.times)), np.diff(self.first))

    def values(self, recording: Recording, signal: str) -> Array:
        """Another signal of the same vehicles, shape (row, ...).

        Raises:
            RecordingError: it was not recorded.
            ValueError: it has other vehicles.
        """
        joined = recording[signal].values
        if len(joined) < len(self._order):
            raise ValueError(f"`{signal}` has {len(joined)} rows, but there are {len(self._order)}")
        return np.asarray(joined[self._order])

    def at(self, times: Array) -> Array:
        """The newest communication point at or before each time.

        Args:
            times: [ns], shape (n,).

        Returns:
            Indices into the communication points, -1 before the first one, shape (n,).
        """
        return np.searchsorted(self.times, times, side="right") - 1

    def rows(self, points: Array, ids: Array) -> Array:
        """The rows of vehicles.

        Args:
            points: indices into `times`, shape (n,); -1 is before the first.
            ids: numbers of vehicles, shape (n,).

        Returns:
            The row of each, or `ABSENT`, shape (n,).
        """
        wanted = _key(points, ids)
        found = np.searchsorted(self._keys, wanted)
        found[found == len(self._keys)] = 0
        is_there = self._keys[found] == wanted if len(self._keys) else np.zeros(len(found), bool)
        return np.where(is_there, found, ABSENT)

    def slices(self) -> Iterator[tuple[int, slice]]:
        """Every communication point, as an index into `times`, with its rows."""
        for point, (start, end) in enumerate(itertools.pairwise(self.first)):
            yield point, slice(int(start), int(end))


def beneath(vehicle: str, *names: str) -> tuple[str, ...]:
    """The signals of these names beneath `vehicle`, `component.connector`."""
    return tuple(f"{vehicle}.{name}" for name in names)


def vehicles_in(recording: Recording, vehicle: str) -> Vehicles:
    """Read the vehicles.

    Args:
        recording: of a run.
        vehicle: what the names of their signals begin with, `component.connector`.

    Raises:
        RecordingError: `id` or `position` beneath `vehicle` was not recorded.
        ValueError: there is no sample.
    """
    series = recording[f"{vehicle}.id"]
    places = recording[f"{vehicle}.position"]
    count = min(len(series), len(places))
    if count == 0:
        raise ValueError(f"`{vehicle}` was recorded at no time")
    lengths = np.array([len(np.asarray(series[k])) for k in range(count)], np.int64)
    first = np.concatenate([np.zeros(1, np.int64), np.cumsum(lengths)])
    ids = np.asarray(series.values[: first[-1]], np.int64)
    keys = _key(np.repeat(np.arange(count), lengths), ids)
    order = np.argsort(keys, kind="stable")
    return Vehicles(
        times=np.asarray(series.times[:count]),
        first=first,
        ids=ids[order],
        position=np.asarray(places.values[: first[-1]])[order],
        _order=order,
        _keys=keys[order],
    )


def plane_distance(vehicles: Vehicles, a: Array, b: Array) -> Array:
    """Distances in the plane of vehicles in rows `a` and `b` [m], of their common shape."""
    offset = vehicles.position[a, :2] - vehicles.position[b, :2]
    return np.asarray(np.hypot(offset[..., 0], offset[..., 1]))


def _key(points: Array, ids: Array) -> Array:
    """One number for a point and a vehicle, of the same order; vehicles are below 2^31."""
    return np.asarray((np.asarray(points, np.int64) << 32) + ids)


def near_pairs(vehicles: Vehicles, rows: Array, radius: float) -> tuple[Array, Array]:
    """Pairs of vehicles whose middles are at most `radius` [m] apart in the plane.

    Args:
        vehicles: all of them.
        rows: those of one communication point that count, shape (n,).
        radius: [m].

    Returns:
        Rows of the one and of the other, every pair once, shape (pair,) each.
    """
    x = vehicles.position[rows, 0]
    order = np.argsort(x, kind="stable")
    x, rows = x[order], rows[order]
    ends = np.searchsorted(x, x + radius, side="right")
    counts = ends - np.arange(len(rows)) - 1
    first = np.repeat(np.arange(len(rows)), counts)
    step = np.arange(len(first)) - np.repeat(np.cumsum(counts) - counts, counts)
    a, b = rows[first], rows[first + 1 + step]
    is_near = plane_distance(vehicles, a, b) <= radius
    return a[is_near], b[is_near]
