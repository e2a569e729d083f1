"""One part of a recording while it is written: rows arrive, and blocks of them are stored.

Rows that do not fill a block yet are flushed, as they are, to a `.npy` file that grows beside the
file of blocks. A block is on disk before that file goes, so that at no time less can be read
than before.
"""

import hashlib
import io
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from orchestrator.recording.blocks import BlockFile
from orchestrator.recording.columns import Form
from orchestrator.recording.fingerprint import PartDigest
from orchestrator.recording.growing import GrowingArray
from orchestrator.recording.layout import tail_of

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

    __slots__ = ("_buffer", "_dtype", "_flushed", "_held", "_kind", "_known", "_lengths", "_name",
                 "_path", "_row_bytes", "_row_shape", "_rows", "_samples", "_sha256", "_stored",
                 "_tail", "_write")  # fmt: skip

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
        self._row_bytes = dtype.itemsize * int(np.prod(row_shape, dtype=np.int64))
        form = None if samples else Form.of_rows(dtype.itemsize, self._row_bytes)
        self._stored = BlockFile(path, dtype, row_shape, form)
        self._sha256 = hashlib.sha256()
        self._tail: GrowingArray | None = None
        self._buffer = io.BytesIO()  # the next block; used again: new memory costs page faults
        self._write = self._buffer.write
        self._held = 0  # bytes of the next block
        self._known = 0  # of them flushed, and in the digest
        self._rows = 0  # of the next block
        self._flushed = 0  # of them in the tail
        self._lengths: list[int] = []  # of the samples in the next block

    @property
    def digest(self) -> PartDigest:
        """The digest of all rows that were flushed or stored."""
        return PartDigest(self._name, self._kind, self._sha256.hexdigest())

    @property
    def size(self) -> int:
        """The size of the file of blocks [byte]."""
        return self._stored.size

    def append(self, rows: bytes, count: int = 1) -> None:
        """Append `count` rows, given in C order; no block ends between them."""
        if self._samples:
            self._lengths.append(len(rows))
        self._take(rows, count)

    def append_rows(self, data: bytes, count: int) -> None:
        """Append `count` rows, given in C order, as if each were appended alone.

        Raises:
            ValueError: `data` has another size, or rows are no samples here.
        """
        size = self._row_bytes
        if self._samples:
            raise ValueError(f"`{self._name}` takes samples of bytes, not rows")
        if len(data) != count * size:
            what = f"{len(data)} bytes, not {count} rows of {size} bytes"
            raise ValueError(f"`{self._name}` was given {what}")
        if self._held + len(data) < BLOCK_BYTES:
            self._take(data, count)
            return
        rest = memoryview(data)
        while count:
            missing = -(-(BLOCK_BYTES - self._held) // size) if size else count
            some = min(count, missing)
            self._take(rest[: some * size], some)
            rest, count = rest[some * size :], count - some

    def append_samples(self, data: bytes, lengths: Sequence[int] | npt.NDArray[np.int64]) -> None:
        """Append samples of any number of rows, as if each were appended alone.

        Args:
            data: their rows in C order, one sample after the other.
            lengths: of each sample [byte], shape (sample,).

        Raises:
            ValueError: `data` has another size, or a length is not that of a number of rows, which
                none is if a row has no bytes.
        """
        each = np.asarray(lengths, np.int64)
        size = self._row_bytes
        if size == 0 or (each < 0).any() or (each % size).any() or each.sum() != len(data):
            what = f"{len(data)} bytes, not {len(each)} samples of rows of {size} bytes"
            raise ValueError(f"`{self._name}` was given {what}")
        rest, ends, first, start = memoryview(data), np.cumsum(each), 0, 0
        while first < len(each):
            full = start + BLOCK_BYTES - self._held
            until = min(int(np.searchsorted(ends, full)) + 1, len(each))
            end = int(ends[until - 1])
            if self._samples:
                self._lengths += each[first:until].tolist()
            self._take(rest[start:end], (end - start) // size)
            first, start = until, end

    def flush(self) -> None:
        """Let a reader have everything that was appended."""
        fresh = self._rows - self._flushed
        if not fresh:
            return
        if self._tail is None:
            path = tail_of(self._path, self._stored.rows)
            self._tail = GrowingArray(path, self._dtype, self._row_shape)
        self._tail.append(self._buffer.getbuffer()[self._known : self._held], fresh)
        self._flushed = self._rows
        self._digest()

    def close(self) -> None:
        """Store what is left, and that this is all."""
        if self._rows:
            self._store(is_last=True)
        else:
            self._stored.end()
        self._buffer = io.BytesIO()

    def _take(self, rows: bytes | memoryview, count: int) -> None:
        """Add rows to the next block, and store it if it is large enough then."""
        self._write(rows)
        self._rows += count
        self._held += len(rows)
        if self._held >= BLOCK_BYTES:
            self._store()

    def _store(self, *, is_last: bool = False) -> None:
        content = self._buffer.getbuffer()[: self._held]
        self._stored.append(content, self._rows, self._lengths, is_last=is_last)
        self._digest()
        if self._tail is not None:
            self._tail.remove()
            self._tail = None
        self._buffer.seek(0)
        self._lengths.clear()
        self._rows = self._flushed = self._held = self._known = 0

    def _digest(self) -> None:
        """Let what was appended since the last time count in the digest."""
        self._sha256.update(self._buffer.getbuffer()[self._known : self._held])
        self._known = self._held
