"""One part of a recording while it is written: rows arrive, and blocks of them are stored.

Rows that do not fill a block yet are flushed, as they are, to a `.npy` file that grows beside the
file of blocks. A block is on disk before that file goes, so that at no time less can be read
than before.
"""

import hashlib
from pathlib import Path
from typing import Any, Final

import numpy as np

from orchestrator.recording.blocks import BlockFile
from orchestrator.recording.columns import Form
from orchestrator.recording.fingerprint import PartDigest
from orchestrator.recording.growing import GrowingArray
from orchestrator.recording.layout import tail_of
from orchestrator.signal import Array

BLOCK_BYTES: Final = 4 << 20
"""A block is stored when it has at least so many bytes; the fewer, the less there is to find."""


class Part:
    """Takes the rows of one part and stores them in blocks.

    Where blocks end depends on what is appended only, not on when it is flushed.

    Args:
        path: of the file of blocks, which is created.
        name: of the part within the run directory, for its digest.
        dtype: of an element.
        row_shape: shape of a row.
        kind: the declared type of the signal; empty for times, row counts and shapes.
        samples: whether what is appended at once is a sample of bytes, whose lengths tell how to
            cut them.
    """

    __slots__ = ("_chunks", "_digest", "_dtype", "_flushed", "_held", "_kind", "_lengths", "_name",
                 "_path", "_row_shape", "_rows", "_samples", "_stored", "_tail")  # fmt: skip

    def __init__(
        self,
        path: Path,
        name: str,
        dtype: "np.dtype[Any]",
        row_shape: tuple[int, ...] = (),
        *,
        kind: str = "",
        samples: bool = False,
    ) -> None:
        self._path, self._name, self._kind = path, name, kind
        self._dtype, self._row_shape = dtype, row_shape
        self._samples = samples
        row_bytes = dtype.itemsize * int(np.prod(row_shape, dtype=np.int64))
        form = None if samples else Form.of_rows(dtype.itemsize, row_bytes)
        self._stored = BlockFile(path, dtype, row_shape, form)
        self._digest = hashlib.sha256()
        self._tail: GrowingArray | None = None
        self._chunks: list[bytes] = []  # of the next block, not flushed
        self._lengths: list[int] = []  # of the samples in the next block
        self._rows = 0  # of the next block
        self._flushed = 0  # of them in the tail
        self._held = 0  # bytes of the next block

    @property
    def digest(self) -> PartDigest:
        """The digest of all rows that were flushed or stored."""
        return PartDigest(self._name, self._kind, self._digest.hexdigest())

    @property
    def size(self) -> int:
        """The size of the file of blocks [byte]."""
        return self._stored.size

    def append(self, rows: bytes, count: int = 1) -> None:
        """Append `count` rows, given in C order."""
        self._chunks.append(rows)
        self._rows += count
        self._held += len(rows)
        if self._samples:
            self._lengths.append(len(rows))
        if self._held >= BLOCK_BYTES:
            self._store()

    def append_rows(self, rows: bytes, count: int, at_once: int = 1) -> None:
        """Append `count` rows; blocks end where they do if `at_once` are appended at a time."""
        size = len(rows) // count * at_once if count else 0
        if not size:
            return
        at, end = 0, len(rows)
        while at < end:
            room = max(1, -(-(BLOCK_BYTES - self._held) // size)) * size
            part = rows[at : at + room]
            self.append(part, len(part) // size * at_once)
            at += len(part)

    def append_samples(self, data: bytes, lengths: Array) -> None:
        """Append samples of bytes; blocks end where they do one by one."""
        at = 0
        for length in lengths.tolist():
            self.append(data[at : at + length], length)
            at += length

    def flush(self) -> None:
        """Let a reader have everything that was appended."""
        fresh = self._rows - self._flushed
        if not fresh:
            return
        if self._tail is None:
            path = tail_of(self._path, self._stored.rows)
            self._tail = GrowingArray(path, self._dtype, self._row_shape)
        self._tail.append(self._fresh(), fresh)
        self._flushed = self._rows

    def close(self) -> None:
        """Store what is left, and that this is all."""
        if self._rows:
            self._store()
        self._stored.end()

    def _store(self) -> None:
        fresh = self._fresh()
        content = fresh if self._tail is None else self._tail.content() + fresh
        self._stored.append(content, self._rows, self._lengths)
        if self._tail is not None:
            self._tail.remove()
            self._tail = None
        self._lengths.clear()
        self._rows = self._flushed = self._held = 0

    def _fresh(self) -> bytes:
        """What was appended since it was asked last, which now counts in the digest."""
        fresh = b"".join(self._chunks)
        self._chunks.clear()
        self._digest.update(fresh)
        return fresh
