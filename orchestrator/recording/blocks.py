"""Files of compressed blocks: how they are written, scanned and read, whatever happened to them.

A file is a sequence of frames as Zstandard defines them (RFC 8878, section 3.1), and `zstd -t`
checks it. A skippable frame holds a *note*: the CRC-32 of a JSON object, and the object. The
first note says what the rows are; each other one opens a block and is followed by its compressed
frames, which have checksums of their own. docs/formats.md describes it for other languages.
"""

import json
import os
import struct
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO, Final

import numpy as np

from orchestrator.disk import naming
from orchestrator.recording.columns import Columns, Form, Room, compress, join
from orchestrator.recording.growing import write_all
from orchestrator.recording.layout import RecordingError
from orchestrator.zstd import ZstdError, decompressed

VERSION: Final = 1
_MAGIC: Final = struct.pack("<I", 0x184D2A50)
_JSON: Final = json.JSONEncoder(separators=(",", ":")).encode
_HEAD: Final = struct.Struct("<4sII")  # magic, bytes that follow, CRC-32 of the JSON


@dataclass(frozen=True, slots=True, kw_only=True)
class Block:
    """A block as its note says.

    Attributes:
        offset: of the note in the file [byte].
        start: of the first frame after it [byte].
        first: the index of its first row in the file.
        rows: how many it has.
        frames: the size of each frame [byte].
        about: what `columns.join` must know.
    """

    offset: int
    start: int
    first: int
    rows: int
    frames: tuple[int, ...]
    about: Mapping[str, Any]

    @property
    def end(self) -> int:
        """Where the next block begins [byte]."""
        return self.start + sum(self.frames)


@dataclass(frozen=True, slots=True, kw_only=True)
class Contents:
    """What was found in a file.

    Attributes:
        dtype: of an element.
        row_shape: shape of a row.
        blocks: those that are there from the first to the last byte.
        damage: what is wrong with the file, each with its place.
        cut: the place where it ends too early, if it does.
        ended: whether whoever wrote it came to its end.
    """

    dtype: "np.dtype[Any]"
    row_shape: tuple[int, ...]
    blocks: tuple[Block, ...]
    damage: tuple[str, ...]
    cut: tuple[str, ...]
    ended: bool


class BlockFile:
    """Appends blocks of rows to a file. No file stays open.

    Args:
        path: of the file, which is created.
        dtype: of an element.
        row_shape: shape of a row.
        form: how rows are cut; `None`: samples of bytes, whose lengths tell.
        memory: of such a file that exists, which is gone on with; `None`: it is created.
        room: in which blocks are made; `None`: one of its own.

    Attributes:
        size: of the file so far [byte].
    """

    __slots__ = ("_columns", "_is_torn", "_path", "_rows", "size")

    def __init__(
        self,
        path: Path,
        dtype: "np.dtype[Any]",
        row_shape: tuple[int, ...],
        form: Form | None,
        *,
        memory: Mapping[str, Any] | None = None,
        room: Room | None = None,
    ) -> None:
        self._path = path
        self._columns = Columns(form, room or Room())
        self._rows = 0
        self._is_torn = False  # whether something stands behind `size`
        if memory is not None:
            self.size: int = memory["size"]
            self._rows = memory["rows"]
            self._columns.recall(memory["columns"])
            with naming(path):
                os.truncate(path, self.size)
            return
        descr = np.lib.format.dtype_to_descr(dtype)
        opening = _note({"nlosim": VERSION, "descr": descr, "shape": list(row_shape)})
        with naming(path):
            path.write_bytes(opening)
        self.size = len(opening)

    @property
    def rows(self) -> int:
        """Rows in the file."""
        return self._rows

    def memory(self) -> dict[str, Any]:
        """What it knows of the file, as `orchestrator.packing` takes it."""
        return {"size": self.size, "rows": self._rows, "columns": self._columns.memory()}

    def append(
        self,
        content: bytes | memoryview,
        rows: int,
        lengths: Sequence[int],
        *,
        is_last: bool = False,
    ) -> bytes:
        """Compress and write a block.

        Args:
            content: the rows in C order.
            rows: how many.
            lengths: bytes of each sample, where they tell how to cut.
            is_last: write also that there are no more blocks, in place of `end`.

        Returns:
            What was written.
        """
        about, streams = self._columns.split(content, lengths) if content else (_EMPTY, [])
        frames = [compress(each) for each in streams]
        sizes = [len(each) for each in frames]
        note = _note({"first": self._rows, "rows": rows, "frames": sizes, **about})
        end = _end_note(self._rows + rows) if is_last else b""
        data = b"".join((note, *frames, end))
        self._write(data)
        self._rows += rows
        self._columns.learn(sum(sizes) / max(len(content), 1))
        return data

    def append_same(self, block: bytes, other: "BlockFile") -> None:
        """Write the block that `other`, which has had the same rows all along, has made last."""
        self._write(block)
        self._rows = other.rows
        self._columns.recall(other.memory()["columns"])

    def end(self) -> None:
        """Write that there are no more blocks."""
        self._write(_end_note(self._rows))

    def _write(self, data: bytes) -> None:
        with naming(self._path), self._path.open("r+b", buffering=0) as file:
            if self._is_torn:  # an earlier attempt failed halfway
                file.truncate(self.size)
            self._is_torn = True
            file.seek(self.size)
            try:
                write_all(file, data)
            except OSError:
                file.truncate(self.size)  # what is there of it is no block
                raise
        self._is_torn = False
        self.size += len(data)


_EMPTY: Final[dict[str, Any]] = {"stride": 1, "word": 1, "head": 0, "columns": []}


def scan(path: Path) -> Contents:
    """What is in the file `path`; only notes are read.

    Raises:
        RecordingError: it does not begin as such a file does.
        FileNotFoundError: there is none.
    """
    size = path.stat().st_size
    with path.open("rb") as file:
        opening = _read_note(file, 0)
        if opening is None or not opening.keys() >= {"descr", "shape", "nlosim"}:
            raise RecordingError(f"`{path}` is damaged at byte 0: no opening note")
        descr, shape, version = opening["descr"], opening["shape"], opening["nlosim"]
        if version != VERSION:
            raise RecordingError(f"`{path}` has version {version}; this release reads {VERSION}")
        blocks: list[Block] = []
        damage: list[str] = []
        cut: tuple[str, ...] = ()
        at = file.tell()
        ended = False
        while at < size:
            note = _read_note(file, at)
            if note is not None and "end" in note:
                ended, at = True, file.tell()
                continue
            block = None if note is None else _block(note, at, file.tell())
            if block is None:
                after = _find(file, at + 1)
                if after is None:
                    cut = (f"`{path}` has no block from byte {at} to its end at byte {size}",)
                    break
                damage.append(f"`{path}` is damaged from byte {at} to {after}: no block")
                at = after
            elif block.end > size:
                cut = (f"`{path}` ends at byte {size}, within the block at byte {at}",)
                break
            else:
                blocks.append(block)
                at = block.end
    if isinstance(descr, list):  # JSON has no tuples, NumPy insists on them
        descr = [tuple(field) for field in descr]
    return Contents(
        dtype=np.lib.format.descr_to_dtype(descr),
        row_shape=tuple(shape),
        blocks=tuple(blocks),
        damage=tuple(damage),
        cut=cut,
        ended=ended,
    )


def read_block(path: Path, block: Block, size: int) -> "np.ndarray[Any, Any]":
    """The content of `block` in the file `path` as bytes, uint8, shape (size,).

    Raises:
        RecordingError: it is damaged.
    """
    with path.open("rb") as file:
        file.seek(block.start)
        data = file.read(block.end - block.start)
    streams, at = [], 0
    for length in block.frames:
        try:
            # at most a number for each byte of the block
            streams.append(decompressed(data[at : at + length], 8 * size))
        except ZstdError as error:
            raise RecordingError(_damaged(path, block, at, error)) from error
        at += length
    try:
        content = join(block.about, streams) if streams else np.zeros(0, np.uint8)
    except (KeyError, ValueError, IndexError) as error:
        raise RecordingError(_damaged(path, block, 0, error)) from error
    if len(content) != size:
        raise RecordingError(_damaged(path, block, 0, f"{len(content)} bytes, not {size}"))
    return content


def _damaged(path: Path, block: Block, at: int, error: object) -> str:
    return (
        f"`{path}` is damaged at byte {block.start + at}: {error}; "
        f"the {block.rows} rows from {block.first} on are lost"
    )


def _note(content: Mapping[str, Any]) -> bytes:
    return _framed(_JSON(content).encode())


def _end_note(rows: int) -> bytes:
    return _framed(b'{"end":%d}' % rows)


def _framed(text: bytes) -> bytes:
    return _HEAD.pack(_MAGIC, len(text) + 4, zlib.crc32(text)) + text


def _read_note(file: BinaryIO, at: int) -> dict[str, Any] | None:
    """The note at byte `at`, if there is one; `file` stands behind it."""
    file.seek(at)
    head = file.read(_HEAD.size)
    if len(head) < _HEAD.size:
        return None
    magic, size, check = _HEAD.unpack(head)
    rest = os.fstat(file.fileno()).st_size - file.tell()
    if magic != _MAGIC or not 4 <= size <= rest + 4:  # else memory for up to 4 GB would be asked
        return None
    text = file.read(size - 4)
    if len(text) < size - 4 or zlib.crc32(text) != check:
        return None
    content: dict[str, Any] = json.loads(text)
    return content


def _block(note: dict[str, Any], offset: int, start: int) -> Block | None:
    """The block that `note` opens, if it is no other kind of note."""
    if "rows" not in note:
        return None
    return Block(
        offset=offset,
        start=start,
        first=note.pop("first"),
        rows=note.pop("rows"),
        frames=tuple(note.pop("frames")),
        about=note,
    )


def _find(file: BinaryIO, at: int) -> int | None:
    """Where the next block or the end is noted from byte `at` on, if it is."""
    file.seek(at)
    rest = file.read()
    found = rest.find(_MAGIC)
    while found >= 0:
        if _read_note(file, at + found) is not None:
            return at + found
        found = rest.find(_MAGIC, found + 1)
    return None
