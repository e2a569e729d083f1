"""What is recorded of one unit: every value of some of its outputs, in rows."""

import ctypes
from collections.abc import Sequence
from typing import Any, Final

import numpy as np

from orchestrator.plan import layouts
from orchestrator.plan.memory import Outputs
from orchestrator.signal import Array
from orchestrator.stretch import Rows

_CACHE_LINE: Final = 64
_MOST_SHELVED: Final = 256
"""Bytes of outputs that are recorded many points at once; more are copied one by one."""


class Recorded:
    """The rows of one unit.

    Args:
        names: of the outputs of which every value is wanted.
        outputs: all, as they lie in memory.
    """

    def __init__(self, names: Sequence[str], outputs: Outputs) -> None:
        self._names = names
        self._outputs = outputs
        self._tracks: list[layouts.Track] = []
        self._keep: list[Any] = []  # what the table points to
        self._rings: dict[str, tuple[memoryview, int, tuple[int, ...]]] = {}
        self._binary_rings: dict[str, tuple[layouts.Track, Array]] = {}
        self._sampled = 0  # samples that lie in `_rows`
        self._rows: dict[str, Rows] = {}

    @property
    def point_bytes(self) -> int:
        """What one point takes, Binary left out [byte]."""
        places = self._outputs.places
        return 8 + sum(places[name].size for name in self._names if name in places)

    def describe(self, table: layouts.Unit) -> None:
        """Let the engine know what to record."""
        outputs = self._outputs
        tracks = (layouts.Track * len(self._names))()
        table.track, table.tracks = tracks, len(tracks)
        self._tracks = [table.track[k] for k in range(table.tracks)]
        self._keep.append(tracks)
        if self._names and len(outputs.block) <= _MOST_SHELVED:
            table.size = len(outputs.block)
            shelf = np.empty(layouts.SHELF * table.size, np.uint8)
            self._keep.append(shelf)
            table.shelf = shelf.ctypes.data
        for track, name in zip(self._tracks, self._names, strict=True):
            track.offset = outputs.offset(name)
            track.is_binary = name in outputs.binaries
            track.size = 8 if track.is_binary else outputs.places[name].size

    def room(self, points: int) -> int:
        """How much memory so many samples take [byte]."""
        return sum(_room(points * track.size) for track in self._tracks)

    def reserve(self, points: int, address: int, memory: memoryview) -> None:
        """Use `memory` for so many samples.

        Args:
            points: how many.
            address: of the memory.
            memory: bytes, as many as `room` says; it stays where it is.
        """
        at, self._sampled = 0, 0
        for track, name in zip(self._tracks, self._names, strict=True):
            size = points * track.size
            track.row = address + at
            own = memory[at : at + size]
            if track.is_binary:
                self._binary_rings[name] = track, np.frombuffer(own, np.int64)
            else:
                self._rings[name] = own, track.size, self._outputs.places[name].shape
            at += _room(size)

    def rows(self, count: int) -> dict[str, Rows]:
        """The first `count` samples of each output."""
        if count != self._sampled:
            self._sampled = count
            self._rows = {
                name: Rows(ring[: count * size], shape=shape)
                for name, (ring, size, shape) in self._rings.items()
            }
        rows = self._rows
        if self._binary_rings:
            rows = dict(rows)
        for name, (track, sizes) in self._binary_rings.items():
            content = track.bytes
            binary = ctypes.string_at(content.data, content.size) if content.size else b""
            rows[name] = Rows(binary, sizes[:count])
        return rows

    def release(self, library: Any) -> None:
        """Free what the engine allocated."""
        for track in self._tracks:
            library.plan_release(ctypes.byref(track.bytes))


def _room(size: int) -> int:
    """Memory for the samples of one signal [byte].

    Rows of powers of two would all begin at the same place of a cache; so they are one line apart.
    """
    return (size // _CACHE_LINE + 2) * _CACHE_LINE
