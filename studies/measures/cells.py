"""Which of many boxes may lie along which of many segments."""

from typing import Final

import numpy as np

from orchestrator.signal import Array

_HALF: Final = 1 << 29
"""Added to numbers of cells, so that they are positive."""


class Cells:
    """Boxes along the axes, noted in every square cell that they are near.

    Args:
        low: lower corners [m], shape (box, 2).
        high: upper corners [m], shape (box, 2).
        side: of a cell [m].
    """

    def __init__(self, low: Array, high: Array, side: float) -> None:
        self._side, self._count = side, len(low)
        # every point of a segment is within half a side of one of its samples
        first, last = self._cells(low - side / 2), self._cells(high + side / 2)
        extent = last - first + 1
        box, place = spread_out(extent.prod(axis=1))
        column, row = np.divmod(place, extent[box, 1])
        keys = _key(first[box, 0] + column, first[box, 1] + row)
        order = np.argsort(keys, kind="stable")
        self._keys, self._starts = np.unique(keys[order], return_index=True)
        self._ends = np.append(self._starts[1:], len(keys))
        self._boxes = box[order]

    def along(self, start: Array, end: Array) -> tuple[Array, Array]:
        """Pairs of a segment and a box that may meet; all that do are among them.

        Args:
            start: where segments begin [m], shape (segment, 2).
            end: where they end [m], shape (segment, 2).

        Returns:
            The numbers of segment and box of each pair, every pair once, shape (pair,) both.
        """
        if self._count == 0 or len(start) == 0:
            return np.empty(0, np.int64), np.empty(0, np.int64)
        samples = np.ceil(np.hypot(*(end - start).T) / self._side).astype(np.int64) + 1
        segment, place = spread_out(samples)
        share = (place / np.maximum(samples[segment] - 1, 1))[:, None]
        cells = self._cells(start[segment] + share * (end - start)[segment])
        keys = _key(cells[:, 0], cells[:, 1])
        found = np.minimum(np.searchsorted(self._keys, keys), len(self._keys) - 1)
        is_there = self._keys[found] == keys
        segment, found = segment[is_there], found[is_there]
        sample, place = spread_out(self._ends[found] - self._starts[found])
        box = self._boxes[self._starts[found][sample] + place]
        pairs = np.sort(segment[sample] * self._count + box)  # quicker than `unique`
        pairs = pairs[np.append([True], pairs[1:] != pairs[:-1])[: len(pairs)]]
        first, second = np.divmod(pairs, self._count)
        return np.asarray(first), np.asarray(second)

    def _cells(self, points: Array) -> Array:
        return np.asarray(np.floor(points / self._side).astype(np.int64) + _HALF)


def spread_out(counts: Array) -> tuple[Array, Array]:
    """Each index as often as `counts` says, and how often it has stood before, shape (sum,)."""
    index = np.repeat(np.arange(len(counts)), counts)
    before = np.cumsum(counts) - counts
    return index, np.arange(len(index)) - before[index]


def _key(column: Array, row: Array) -> Array:
    return np.asarray((column << 31) + row)
