"""What lies around the places that a lidar sees: small images of the last scans."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, TypeAlias

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from fmus.driving.network.scan import CELL, SIDE, Scan
from orchestrator.signal import Array
from orchestrator.timebase import Duration, Time

LAGS: Final[tuple[Duration, ...]] = (100_000_000, 300_000_000)
"""Ages of the earlier scans beside the newest one [ns]; what moves differs between them."""
WINDOW: Final = 12
"""Side of an image in cells; 4.8 m."""
CHANNELS: Final = 2 + len(LAGS)
"""The newest scan's two layers; of each earlier one, both in one."""
INPUTS: Final = CHANNELS * WINDOW * WINDOW

Stack: TypeAlias = Sequence[Scan | None]
"""Scans of one sensor, the newest first, then those of `LAGS` before it where they are known."""

_MIDDLES: Final = (0.0, 1.0, 2.8)
"""Heights of the middles of the layers over the ground [m], the ground first."""
_BLOCK: Final = 2
_BLOCKS: Final = SIDE // _BLOCK
_MARGIN: Final = (WINDOW - _BLOCK) // 2


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Patches:
    """The places with something in the newest scan, and what lies around them.

    Attributes:
        x, y: of the places in the sensor's frame [m], shape (place,).
        z: over the ground [m], the middle of the highest layer there, shape (place,).
        rows, columns: of the first cells of their images, shape (place,).
        windows: the image at every cell, a view, shape (channel, row, column, WINDOW, WINDOW).
    """

    x: Array
    y: Array
    z: Array
    rows: Array
    columns: Array
    windows: Array

    @property
    def image(self) -> Array:
        """The images of all places, shape (place, INPUTS); see `images`."""
        return self.images(np.arange(len(self.rows)))

    def images(self, which: Array) -> Array:
        """The images of these places.

        Args:
            which: indices, shape (n,).

        Returns:
            0 or 1, float32, shape (n, INPUTS): channels, rows along the heading, columns.
        """
        found = self.windows[:, self.rows[which], self.columns[which]]
        return found.swapaxes(0, 1).reshape(len(which), INPUTS)


class History:
    """The scans of one sensor that are needed again."""

    def __init__(self) -> None:
        self._scans: list[Scan] = []

    def add(self, scan: Scan) -> None:
        """Take in the next scan.

        One of the same time as the last replaces it; an older one begins a new history.
        """
        if self._scans and self._scans[-1].time > scan.time:
            self._scans = []
        oldest = scan.time - max(LAGS)
        self._scans = [s for s in self._scans if oldest <= s.time < scan.time] + [scan]

    @property
    def stack(self) -> Stack:
        """The newest scan, and those of `LAGS` before it where they are known."""
        if not self._scans:
            return ()
        newest = self._scans[-1]
        by_time: dict[Time, Scan] = {scan.time: scan for scan in self._scans}
        return newest, *(by_time.get(newest.time - lag) for lag in LAGS)


def patches(stack: Stack, others: Sequence[Stack] = ()) -> Patches:
    """The images of a stack of scans, or of several that are laid over each other.

    A place is a block of 2 x 2 cells; its image is centred on it. All is in the frame of the newest
    scan of `stack`.

    Args:
        stack: the scans of a sensor, the newest first; that one must be there.
        others: of other sensors, whose newest scans may be a little older.
    """
    newest = stack[0]
    if newest is None:
        raise ValueError("the newest scan is missing")
    grid = np.zeros((CHANNELS, SIDE + 2 * _MARGIN, SIDE + 2 * _MARGIN), np.float32)
    inner = grid[:, _MARGIN:-_MARGIN, _MARGIN:-_MARGIN]
    blocks = np.zeros((_BLOCKS, _BLOCKS), np.uint8)
    for each in (stack, *others):
        for lag, scan in enumerate(each):
            if scan is None:
                continue
            row, column, layer = _moved(scan, newest)
            if lag > 0:
                inner[1 + lag, row, column] = 1.0
                continue
            inner[layer, row, column] = 1.0
            place = row // _BLOCK, column // _BLOCK
            blocks[place] = np.maximum(blocks[place], 1 + layer)  # of two cells the last: the upper
    rows, columns = np.nonzero(blocks)
    side = _BLOCK * CELL
    return Patches(
        x=(rows - _BLOCKS // 2 + 0.5) * side,
        y=(columns - _BLOCKS // 2 + 0.5) * side,
        z=np.asarray(_MIDDLES)[blocks[rows, columns]],
        rows=rows * _BLOCK,
        columns=columns * _BLOCK,
        windows=sliding_window_view(grid, (WINDOW, WINDOW), axis=(1, 2)),
    )


def _moved(scan: Scan, newest: Scan) -> tuple[Array, Array, Array]:
    """Rows and columns of a scan's cells in the frame of the newest one, and their layers."""
    if scan.frame == newest.frame:
        layer, place = np.divmod(scan.cells, SIDE * SIDE)
        row, column = np.divmod(place, SIDE)
        return row, column, layer
    ahead, left = scan.frame.to(newest.frame, *scan.centers())
    row = np.floor(ahead / CELL + SIDE // 2).astype(np.int64)
    column = np.floor(left / CELL + SIDE // 2).astype(np.int64)
    inside = (row >= 0) & (row < SIDE) & (column >= 0) & (column < SIDE)
    return row[inside], column[inside], scan.layers()[inside]
