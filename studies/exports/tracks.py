"""Where each road user was over time: all samples of one after the other."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from orchestrator.recording.layout import RecordingError
from orchestrator.recording.reader import Series
from orchestrator.recording.tidy import Lost
from orchestrator.signal import Array
from studies.exports.scene import SMALLEST, Snapshot, Users


@dataclass(frozen=True, slots=True, kw_only=True)
class Tracks:
    """All road users at all times at which they were told.

    Rows are by number, then by time.

    Attributes:
        times: of all samples that could be read [ns], int64, shape (sample,).
        sample: the sample of each row, int64, shape (row,).
        ids: numbers, int64, shape (row,).
        position: middles of the bodies on the ground [m], shape (row, 3).
        heading: counter-clockwise from east [rad], shape (row,).
        size: length, width, height [m], shape (row, 3).
        body: codes of `vehicle.body`, int32, shape (row,).
        is_driven: whether a driven entity is this road user then, bool, shape (row,).
    """

    times: Array
    sample: Array
    ids: Array
    position: Array
    heading: Array
    size: Array
    body: Array
    is_driven: Array

    def each(self) -> Iterator[tuple[int, "Track"]]:
        """Every road user, by number."""
        numbers, first = np.unique(self.ids, return_index=True)
        ends = [*first[1:].tolist(), len(self.ids)]
        for number, begin, end in zip(numbers.tolist(), first.tolist(), ends, strict=True):
            yield number, Track(self, slice(begin, end))

    def places(self, sample: Array, ids: Array) -> tuple[Array, Array]:
        """Where road users were at samples.

        Args:
            sample: int64, shape (n,).
            ids: numbers, int64, shape (n,).

        Returns:
            Positions [m], shape (n, 3); whether they were there, bool, shape (n,).
        """
        if not len(self.ids):
            return np.zeros((len(ids), 3)), np.zeros(len(ids), bool)
        numbers = np.unique(self.ids)
        count = len(self.times)
        known = np.searchsorted(numbers, self.ids) * count + self.sample
        of = np.searchsorted(numbers, ids).clip(0, len(numbers) - 1)
        asked = of * count + sample
        row = np.searchsorted(known, asked).clip(0, len(known) - 1)
        is_there = (known[row] == asked) & (numbers[of] == ids) & (sample >= 0)
        return self.position[row], is_there


@dataclass(frozen=True, slots=True)
class Track:
    """One road user; `rows` are its own among those of all."""

    all: Tracks
    rows: slice

    @property
    def times(self) -> Array:
        """When it was there [ns], int64, shape (row,)."""
        return np.asarray(self.all.times[self.all.sample[self.rows]])

    @property
    def position(self) -> Array:
        """Middles of the body on the ground [m], shape (row, 3)."""
        return np.asarray(self.all.position[self.rows])

    @property
    def heading(self) -> Array:
        """Counter-clockwise from east [rad], shape (row,)."""
        return np.asarray(self.all.heading[self.rows])

    @property
    def size(self) -> Array:
        """Length, width, height [m], shape (row, 3)."""
        return np.asarray(self.all.size[self.rows])

    @property
    def body(self) -> Array:
        """Codes of `vehicle.body`, int32, shape (row,)."""
        return np.asarray(self.all.body[self.rows])

    @property
    def is_driven(self) -> Array:
        """Whether a driven entity is it, bool, shape (row,)."""
        return np.asarray(self.all.is_driven[self.rows])

    @property
    def is_body(self) -> Array:
        """Whether it has a body then, bool, shape (row,)."""
        return np.asarray(self.size[:, 0] >= SMALLEST)

    @property
    def looks(self) -> Array:
        """Rows from which on it looks otherwise, the first and after gaps, too; shape (look,)."""
        sample = self.all.sample[self.rows]
        parts = (self.size, self.body[:, None], self.is_driven[:, None])
        is_new = np.ones(len(sample), bool)
        is_new[1:] = np.diff(sample) != 1
        for part in parts:
            is_new[1:] |= (part[1:] != part[:-1]).any(axis=1)
        return np.flatnonzero(is_new)

    @property
    def gone(self) -> Array:
        """Times of the first samples without it, after it was there [ns], int64, shape (end,)."""
        sample = self.all.sample[self.rows]
        is_last = np.ones(len(sample), bool)
        is_last[:-1] = np.diff(sample) != 1
        after = sample[is_last] + 1
        return np.asarray(self.all.times[after[after < len(self.all.times)]])


def tracks_of(users: Users, driven: Mapping[str, Series], lost: Lost) -> Tracks:
    """The tracks of all road users.

    Args:
        users: of a run.
        driven: the numbers of driven entities, by entity.
        lost: takes the times that cannot be read.

    Returns:
        Rows of shape (row,), times [ns] of shape (sample,).
    """
    found = list(users.snapshots(lost))
    counts = [len(each) for each in found]
    ids = _joined([each.ids for each in found], np.empty(0, np.int64))
    order = np.argsort(ids, kind="stable")
    return Tracks(
        times=np.array([each.time for each in found], np.int64),
        sample=np.repeat(np.arange(len(found)), counts)[order],
        ids=ids[order],
        position=_joined([each.position for each in found], np.empty((0, 3)))[order],
        heading=_joined([each.heading for each in found], np.empty(0))[order],
        size=_joined([each.size for each in found], np.empty((0, 3)))[order],
        body=_joined([each.body for each in found], np.empty(0, np.int32))[order],
        is_driven=_joined([_driven(each, driven) for each in found], np.empty(0, bool))[order],
    )


def _joined(parts: list[Array], none: Array) -> Array:
    return np.concatenate([none, *parts])


def _driven(snapshot: Snapshot, driven: Mapping[str, Series]) -> Array:
    return np.isin(snapshot.ids, [number_at(each, snapshot.time) for each in driven.values()])


def number_at(series: Series, time: int) -> int:
    """The number of a driven entity at a time [ns]; -1 while it is not there or that is lost."""
    try:
        return int(np.asarray(series.at(time)))
    except RecordingError:
        return -1
