"""Parts of a recording, read back block by block when they are asked for."""

import bisect
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import lru_cache, partial
from pathlib import Path
from typing import Any

import numpy as np

from orchestrator.recording.blocks import Block, read_block, scan
from orchestrator.recording.growing import read_growing
from orchestrator.recording.layout import RecordingError, plain_of, tails_of
from orchestrator.signal import Array


@dataclass(frozen=True, slots=True)
class _Segment:
    """Rows `first` to `end` - 1, and how to get them."""

    first: int
    end: int
    load: Callable[[], Array]


class Stored:
    """The rows of one part of a recording.

    `stored[a:b]` is an array of those rows, read-only. Blocks are decompressed when a row of them
    is asked for; the last two are kept.

    Attributes:
        dtype: of an element.
        row_shape: shape of a row.
        damage: what is wrong with its file, each with its place.
        cut: where its file ends within a block, as it may if the run was killed.
        ended: whether whoever wrote it came to its end, as far as can be known.
    """

    def __init__(
        self,
        path: Path,
        dtype: "np.dtype[Any]",
        row_shape: tuple[int, ...],
        segments: list[_Segment],
        *,
        damage: tuple[str, ...] = (),
        cut: tuple[str, ...] = (),
        ended: bool = True,
    ) -> None:
        self.dtype = dtype
        self.row_shape = row_shape
        self.damage = damage
        self.cut = cut
        self.ended = ended
        self._path = path
        self._segments = segments
        self._ends = [each.end for each in segments]
        self._rows = lru_cache(maxsize=2)(self._load)

    @classmethod
    def open(cls, path: Path) -> "Stored":
        """The part in the file of blocks `path`, and in what lies beside it.

        Raises:
            RecordingError: there is none, or it cannot be read.
        """
        for _ in range(100):
            try:
                return cls._open(path)
            except FileNotFoundError:
                # the run goes on, and what was beside the file is in it by now
                if not path.exists():
                    raise RecordingError(f"`{path}` is missing") from None
        raise RecordingError(f"`{path}` changes too fast to be read")

    @classmethod
    def _open(cls, path: Path) -> "Stored":
        if not path.exists() and plain_of(path).exists():
            rows = np.load(plain_of(path), mmap_mode="r", allow_pickle=False)
            whole = _Segment(0, len(rows), partial(_same, np.asarray(rows)))
            return cls(path, rows.dtype, rows.shape[1:], [whole] if len(rows) else [])
        # before the blocks: what is beside them goes when it is in them
        tails = {first: read_growing(each) for first, each in tails_of(path).items()}
        contents = scan(path)
        segments = []
        for block in contents.blocks:
            load = _Decompressed(path, block, contents.dtype, contents.row_shape)
            segments.append(_Segment(block.first, block.first + block.rows, load))
        end = segments[-1].end if segments else 0
        damage = list(contents.damage)
        for first, (rows, wrong) in tails.items():
            if first >= end:  # else its rows are in a block by now
                damage += [wrong] if wrong else []
                if len(rows):
                    segments.append(_Segment(first, first + len(rows), partial(_same, rows)))
        if any(first > end for first in tails):
            damage += contents.cut
        return cls(
            path,
            contents.dtype,
            contents.row_shape,
            segments,
            damage=tuple(damage),
            cut=contents.cut,
            ended=contents.ended,
        )

    def __len__(self) -> int:
        return self._ends[-1] if self._ends else 0

    def __getitem__(self, rows: slice) -> Array:
        """The rows from `rows.start` to `rows.stop`, both within the part.

        Raises:
            RecordingError: some of them are lost.
        """
        first, end = rows.start, rows.stop
        if first >= end:
            return self._empty()
        k = bisect.bisect_right(self._ends, first)
        segment = self._segments[k]
        if segment.first <= first and end <= segment.end:
            return self._rows(k)[first - segment.first : end - segment.first]
        pieces = []
        while first < end:
            segment = self._segments[k]
            if segment.first > first:
                raise self._lost(first, segment.first)
            until = min(end, segment.end)
            pieces.append(self._rows(k)[first - segment.first : until - segment.first])
            first, k = until, k + 1
        joined = np.concatenate(pieces)
        joined.flags.writeable = False
        return joined

    def blocks(self) -> Iterator[Array]:
        """All rows, block by block, shape (row, ...) each.

        Raises:
            RecordingError: some of them are lost.
        """
        expected = 0
        for segment in self._segments:
            if segment.first > expected:
                raise self._lost(expected, segment.first)
            expected = segment.end
            yield segment.load()

    def broken(self) -> Iterator[str]:
        """What is wrong with each block that cannot be decompressed."""
        for segment in self._segments:
            try:
                segment.load()
            except RecordingError as error:
                yield str(error)

    def _load(self, k: int) -> Array:
        return self._segments[k].load()

    def _empty(self) -> Array:
        return np.zeros((0, *self.row_shape), self.dtype)

    def _lost(self, first: int, end: int) -> RecordingError:
        where = "; ".join(self.damage) or f"`{self._path}` is damaged"
        return RecordingError(f"{where}; rows {first} to {end - 1} are lost")


def damage_of(path: Path, *, ended: bool) -> tuple[str, ...]:
    """What is wrong with the part in `path`, each with its place; all of it is read.

    Args:
        path: of the file of blocks.
        ended: whether the run came to its end, so that the file should, too.
    """
    try:
        stored = Stored.open(path)
    except RecordingError as error:
        return (str(error),)
    found = (*stored.damage, *stored.broken())
    if ended and stored.cut:
        found = tuple(dict.fromkeys((*found, *stored.cut)))
    if ended and not stored.ended and not found:
        found = (f"`{path}` ends at byte {path.stat().st_size}, without its end",)
    return found


@dataclass(frozen=True, slots=True)
class _Decompressed:
    """Decompresses a block."""

    path: Path
    block: Block
    dtype: "np.dtype[Any]"
    row_shape: tuple[int, ...]

    def __call__(self) -> Array:
        shape = (self.block.rows, *self.row_shape)
        size = self.dtype.itemsize * int(np.prod(shape, dtype=np.int64))
        content = read_block(self.path, self.block, size)
        rows: Array = (
            np.ndarray(shape, self.dtype, content) if content.size else np.zeros(shape, self.dtype)
        )
        rows.flags.writeable = False
        return rows


def _same(rows: Array) -> Array:
    return rows
