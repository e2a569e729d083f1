"""Links that are met one after the other, and a number of each that is kept."""

from typing import Final

import numpy as np

from orchestrator.signal import Array

UNKNOWN: Final = -1
"""Stands for the row of a link that was not met."""


def link(one: Array, other: Array) -> Array:
    """One number for a link from one to the other; vehicles are below 2^31, shape (n,)."""
    return np.asarray((np.asarray(one, np.int64) << 32) + other)


class Links:
    """The links that were met until now; each has a row, which it keeps."""

    def __init__(self) -> None:
        self._keys = np.empty(0, np.int64)
        self._rows = np.empty(0, np.int64)

    def __len__(self) -> int:
        return len(self._keys)

    def meet(self, links: Array) -> Array:
        """The row of each link, shape (n,); those that were not met before get the next rows.

        Args:
            links: see `link`, shape (n,).
        """
        fresh = np.setdiff1d(links, self._keys)
        if len(fresh):
            at = np.searchsorted(self._keys, fresh)
            rows = np.arange(len(self), len(self) + len(fresh))
            self._keys = np.insert(self._keys, at, fresh)
            self._rows = np.insert(self._rows, at, rows)
        return self.rows(links)

    def rows(self, links: Array) -> Array:
        """The row of each link, or `UNKNOWN`, shape (n,).

        Args:
            links: see `link`, shape (n,).
        """
        if not len(self):
            return np.full(len(links), UNKNOWN, np.int64)
        at = np.minimum(np.searchsorted(self._keys, links), len(self) - 1)
        return np.where(self._keys[at] == links, self._rows[at], UNKNOWN)


def lengthened(column: Array, count: int, value: int) -> Array:
    """`column` with `count` rows, the new ones of which are `value`, shape (count,)."""
    return np.concatenate([column, np.full(count - len(column), value, column.dtype)])
