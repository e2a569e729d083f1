"""One part of a recording while it is written: rows arrive, and blocks of them are stored.

Rows that do not fill a block yet are flushed, as they are, to a `.npy` file that grows beside the
file of blocks, and read back from there when they do: what is in memory is what came since the last
flush, however slowly a part grows. A block is on disk before that file goes, so that at no time
less can be read than before.
"""

import hashlib
import io
from array import array
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

import numpy as np
import numpy.typing as npt
from typing_extensions import override

from orchestrator.recording.blocks import BlockFile
from orchestrator.recording.columns import Form, Room
from orchestrator.recording.fingerprint import PartDigest
from orchestrator.recording.growing import GrowingArray
from orchestrator.recording.layout import tail_of, tails_of
from orchestrator.recording.reopening import NOTHING, Again, Reopened

BLOCK_BYTES: Final = 4 << 20
"""A block is stored when it has at least so many bytes; the fewer, the less there is to find."""

_SMALL: Final = 1 << 12
"""Rows of fewer bytes are copied, even if they may be kept."""


class Viewed(io.BytesIO):
    """Memory that may be thrown away before its views.

    Frames in the traceback of an error keep views. Python closes what is thrown away, which it
    refuses while there are views, and from 3.13 on it prints that.
    """

    @override
    def close(self) -> None:
        with suppress(BufferError):
            super().close()


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Made:
    """A block that was made.

    Attributes:
        content: its rows.
        before: the digest of the rows of earlier blocks and flushes.
        block: what was written of it.
        sha256: of all rows.
        stored: where it was written.
    """

    content: bytes
    before: bytes
    block: bytes
    sha256: Any
    stored: BlockFile

    def is_same(self, content: memoryview, sha256: Any) -> bool:
        """Whether a block behind rows of the digest `sha256` becomes this one, byte for byte."""
        return (
            self.content == bytes(content)  # a memoryview would compare number by number
            and self.before == sha256.digest()
        )


class Latest:
    """The block of times that was made last: many components publish at the same ones.

    Parts that share it are given rows that are appended one by one, or as if they were: so equal
    rows lie in equal blocks.
    """

    __slots__ = ("made",)

    def __init__(self) -> None:
        self.made: _Made | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Shared:
    """What the parts of a recording have in common.

    Attributes:
        again: what was there at a checkpoint, by name.
        room: in which blocks are made.
        times: of the components.
    """

    again: Again = field(default_factory=lambda: NOTHING)
    room: Room = field(default_factory=Room)
    times: Latest = field(default_factory=Latest)

    def release(self) -> None:
        """Give memory back; parts can go on."""
        self.room.release()
        self.times.made = None


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
        latest: where equal blocks of other parts are found; `None`: none is expected.
        shared: with the other parts of the recording; `None`: there are no others, and it is new.

    Attributes:
        name: as given.
    """

    __slots__ = ("_buffer", "_dtype", "_flushed", "_held", "_kind", "_known", "_latest",
                 "_lengths", "_path", "_pieces", "_room", "_row_bytes", "_row_shape", "_rows",
                 "_samples", "_sha256", "_stored", "_tail", "_write", "name")  # fmt: skip

    def __init__(
        self,
        path: Path,
        name: str,
        dtype: "np.dtype[Any]",
        row_shape: tuple[int, ...] = (),
        *,
        kind: str = "",
        samples: bool = False,
        latest: Latest | None = None,
        shared: Shared | None = None,
    ) -> None:
        shared = shared or Shared()
        self._latest = latest
        self._path, self.name, self._kind = path, name, kind
        self._room = shared.room
        self._dtype, self._row_shape = dtype, row_shape
        self._samples = samples
        self._row_bytes = dtype.itemsize * int(np.prod(row_shape, dtype=np.int64))
        form = None if samples else Form.of_rows(dtype.itemsize, self._row_bytes)
        self._sha256 = hashlib.sha256()
        self._tail: GrowingArray | None = None
        # what came since the last flush: rows that are kept where they are, and behind them copies.
        # Memory of these is used again: new memory costs page faults
        self._pieces: list[bytes | memoryview] = []
        self._buffer = Viewed()
        self._write = self._buffer.write
        self._held = 0  # bytes of the next block
        self._known = 0  # of them in the tail, and in the digest
        self._rows = 0  # of the next block
        self._flushed = 0  # of them in the tail
        self._lengths = array("q")  # of the samples in the next block, but those without bytes
        again = shared.again.get(name)
        if again is None:
            self._stored = BlockFile(path, dtype, row_shape, form, room=self._room)
        else:
            self._go_on(again, form)

    def _go_on(self, again: Reopened, form: Form | None) -> None:
        """Be where the part was; at no time is less on disk than there was."""
        memory = again.memory
        self._sha256 = again.sha256
        self._lengths.extend(n for n in memory["lengths"].tolist() if n)
        self._rows = self._flushed = memory["rows"]
        self._held = self._known = len(again.held)
        first = memory["stored"]["rows"]
        if self._rows:
            path = tail_of(self._path, first)
            self._tail = GrowingArray(path, self._dtype, self._row_shape)
            self._tail.replace(again.held, self._rows)
        self._stored = BlockFile(
            self._path,
            self._dtype,
            self._row_shape,
            form,
            memory=memory["stored"],
            room=self._room,
        )
        for row, path in tails_of(self._path).items():
            if row != first or not self._rows:
                path.unlink()

    def memory(self) -> dict[str, Any]:
        """What it knows once all is flushed, as `orchestrator.packing` takes it."""
        return {
            "stored": self._stored.memory(),
            "rows": self._rows,
            "lengths": np.array(self._lengths, np.int64),
            "sha256": self._sha256.hexdigest(),
        }

    @property
    def digest(self) -> PartDigest:
        """The digest of all rows that were flushed or stored."""
        return PartDigest(self.name, self._kind, self._sha256.hexdigest())

    @property
    def size(self) -> int:
        """The size of the file of blocks [byte]."""
        return self._stored.size

    def append(self, rows: bytes, count: int = 1) -> None:
        """Append `count` rows, given in C order; no block ends between them."""
        if self._samples and rows:
            self._lengths.append(len(rows))
        self._take(rows, count)

    def append_rows(self, data: bytes | memoryview, count: int, *, is_kept: bool = False) -> None:
        """Append `count` rows, given in C order, as if each were appended alone.

        Args:
            data: the rows.
            count: how many.
            is_kept: whether they never change, so that they need not be copied.

        Raises:
            ValueError: `data` has another size, or rows are no samples here.
        """
        size = self._row_bytes
        if self._samples:
            raise ValueError(f"`{self.name}` takes samples of bytes, not rows")
        if len(data) != count * size:
            what = f"{len(data)} bytes, not {count} rows of {size} bytes"
            raise ValueError(f"`{self.name}` was given {what}")
        take = self._keep if is_kept and len(data) >= _SMALL else self._take
        if self._held + len(data) < BLOCK_BYTES:
            take(data, count)
            return
        rest = memoryview(data)
        while count:
            missing = -(-(BLOCK_BYTES - self._held) // size) if size else count
            some = min(count, missing)
            take(rest[: some * size], some)
            rest, count = rest[some * size :], count - some

    def append_samples(
        self, data: bytes | memoryview, lengths: Sequence[int] | npt.NDArray[np.int64]
    ) -> None:
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
            raise ValueError(f"`{self.name}` was given {what}")
        rest, ends, first, start = memoryview(data), np.cumsum(each), 0, 0
        while first < len(each):
            full = start + BLOCK_BYTES - self._held
            until = min(int(np.searchsorted(ends, full)) + 1, len(each))
            end = int(ends[until - 1])
            if self._samples:
                some = each[first:until]
                self._lengths.extend(some[some > 0].tolist())
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
        rows = self._joined(0) if self._pieces else self._copied()
        self._tail.append(rows, fresh)
        self._sha256.update(rows)
        self._forget()
        self._flushed, self._known = self._rows, self._held

    def close(self) -> None:
        """Store what is left, and that this is all."""
        if self._rows:
            self._store(is_last=True)
        else:
            self._stored.end()
        self._buffer = Viewed()
        self._write = self._buffer.write

    def _take(self, rows: bytes | memoryview, count: int) -> None:
        """Add rows to the next block, and store it if it is large enough then."""
        self._write(rows)
        self._rows += count
        self._held += len(rows)
        if self._held >= BLOCK_BYTES:
            self._store()

    def _keep(self, rows: bytes | memoryview, count: int) -> None:
        """`_take` for rows that never change."""
        if self._buffer.tell():
            self._pieces.append(bytes(self._copied()))
            self._buffer.seek(0)
        self._pieces.append(rows)
        self._held += len(rows)
        self._take(b"", count)

    def _store(self, *, is_last: bool = False) -> None:
        if self._known or self._pieces:
            content = self._joined(self._known)
            fresh = content[self._known :]
            if self._tail is not None and self._known:
                self._tail.read_into(content[: self._known])
        else:
            fresh = content = self._copied()
        if self._latest is None:
            self._stored.append(content, self._rows, self._lengths, is_last=is_last)
            self._sha256.update(fresh)
        else:
            self._store_as(self._latest, content, fresh, is_last=is_last)
        if self._tail is not None:
            self._tail.remove()
            self._tail = None
        self._forget()
        del self._lengths[:]
        self._rows = self._flushed = self._held = self._known = 0

    def _store_as(
        self, latest: Latest, content: memoryview, fresh: memoryview, *, is_last: bool
    ) -> None:
        """Store a block that may be the one that another part has stored just now."""
        made = latest.made
        if made and made.is_same(content, self._sha256):
            self._stored.append_same(made.block, made.stored)
            self._sha256 = made.sha256.copy()
            return
        before = self._sha256.digest()
        block = self._stored.append(content, self._rows, self._lengths, is_last=is_last)
        self._sha256.update(fresh)
        latest.made = _Made(
            content=bytes(content),
            before=before,
            block=block,
            sha256=self._sha256.copy(),
            stored=self._stored,
        )

    def _copied(self) -> memoryview:
        """What was copied since the last flush, behind what was kept."""
        return self._buffer.getbuffer()[: self._buffer.tell()]

    def _joined(self, known: int) -> memoryview:
        """What came since the last flush, behind room for `known` bytes."""
        content = self._room.rows.take(known + self._held - self._known).data
        at = known
        for piece in (*self._pieces, self._copied()):
            content[at : at + len(piece)] = piece
            at += len(piece)
        return content

    def _forget(self) -> None:
        """Forget what came since the last flush."""
        self._pieces.clear()
        self._buffer.seek(0)
