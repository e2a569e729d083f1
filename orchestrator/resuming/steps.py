"""What one component was asked to do, on disk: its steps with their inputs.

The file is a sequence of frames; each has its length and that of its content (u32 each), and is
compressed by itself. The content is a sequence of steps: where it starts and its length (i64), the
lengths of what follows (u32 each), the courses of inputs as JSON, and a block of signals
(`orchestrator.remote.wire`). A value that is the same object as before is not written again.
"""

import hashlib
import json
import os
import struct
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Final

from typing_extensions import Buffer, override

from orchestrator.algorithm.journal import Journal
from orchestrator.algorithm.pieces import Piece
from orchestrator.disk import naming
from orchestrator.remote.block import WireError
from orchestrator.remote.courses import courses_from_document, courses_to_document
from orchestrator.remote.wire import SignalDecoder, SignalEncoder
from orchestrator.resuming.files import CheckpointError
from orchestrator.signal import Causality, Connector
from orchestrator.zstd import Compressor, ZstdError, decompressed

_FRAME: Final = struct.Struct("<II")
_STEP: Final = struct.Struct("<qqII")
_CONTENT: Final = 4 << 20
"""A frame is written when its content has so many bytes, or at a checkpoint."""


class StepFile(Journal):
    """Writes down the steps of one component.

    Args:
        path: of the file.
        connectors: of the component.
        memory: what `memory` told at a checkpoint, from which the file goes on; `None`: it begins.

    Attributes:
        count: steps that are written down.
    """

    def __init__(
        self,
        path: Path,
        connectors: Mapping[str, Connector],
        memory: Mapping[str, Any] | None = None,
    ) -> None:
        self._path = path
        self._encoder = SignalEncoder(_inputs(connectors))
        self._compressor = Compressor(1)
        self._content: list[Buffer] = []  # values never change, so they need not be copied yet
        self._length = 0
        self._sha256 = hashlib.sha256()
        self._size = self.count = 0
        self._marks = 0
        self._open: list[Piece] = []  # since the last mark: they may be taken back
        with naming(path):
            if memory is None:
                path.write_bytes(b"")
                return
            self._size, self.count = memory["size"], memory["count"]
            self._sha256.update(path.read_bytes()[: self._size])
            os.truncate(path, self._size)

    @override
    def note(self, piece: Piece) -> None:
        if self._marks:
            self._open.append(piece)
        else:
            self._write_down(piece)

    @override
    def mark(self) -> int:
        self._settle()
        self._marks += 1
        return self._marks

    @override
    def return_to(self, mark: int) -> None:
        if mark != self._marks:
            raise ValueError("a component returned to a state behind which steps are settled")
        self._open.clear()

    def memory(self) -> dict[str, Any]:
        """What the file is, once all is on disk, as `orchestrator.packing` takes it."""
        self._settle()
        self._flush()
        with naming(self._path), self._path.open("r+b") as file:
            os.fsync(file.fileno())
        return {"size": self._size, "count": self.count, "sha256": self._sha256.hexdigest()}

    def _settle(self) -> None:
        for piece in self._open:
            self._write_down(piece)
        self._open.clear()

    def _write_down(self, piece: Piece) -> None:
        said = courses_to_document(piece.courses)
        document = json.dumps(said).encode() if said else b""
        block = self._encoder.parts(piece.inputs)
        length = sum(memoryview(part).nbytes for part in block)
        self._content += (_STEP.pack(piece.t, piece.h, len(document), length), document, *block)
        self._length += _STEP.size + len(document) + length
        self.count += 1
        if self._length >= _CONTENT:
            self._flush()

    def _flush(self) -> None:
        if not self._content:
            return
        frame = self._compressor.frame(b"".join(self._content))
        data = _FRAME.pack(len(frame), self._length) + frame
        with naming(self._path), self._path.open("r+b") as file:
            file.seek(self._size)
            file.write(data)
        self._sha256.update(data)
        self._size += len(data)
        self._content, self._length = [], 0


def check_steps(path: Path, memory: Mapping[str, Any]) -> None:
    """Refuse a file that does not hold what it held at a checkpoint.

    Raises:
        CheckpointError: it does not, or there is none.
    """
    try:
        content = path.read_bytes()[: memory["size"]]
    except OSError as error:
        raise CheckpointError(f"`{path}` cannot be read: {error.strerror}") from error
    if hashlib.sha256(content).hexdigest() != memory["sha256"]:
        raise CheckpointError(f"`{path}` does not hold what it held at the checkpoint")


def read_steps(
    path: Path, connectors: Mapping[str, Connector], memory: Mapping[str, Any]
) -> Iterator[Piece]:
    """The steps that were written down until a checkpoint, in their order.

    Raises:
        CheckpointError: the file is damaged.
    """
    decoder = SignalDecoder(_inputs(connectors))
    try:
        with path.open("rb") as file:
            while file.tell() < memory["size"]:
                length, size = _FRAME.unpack(file.read(_FRAME.size))
                content = decompressed(file.read(length), size)
                at = 0
                while at < len(content):
                    t, h, said, block = _STEP.unpack_from(content, at)
                    at += _STEP.size
                    document = json.loads(content[at : at + said] or b"{}")
                    at += said
                    inputs = decoder.decode(content[at : at + block])
                    at += block
                    yield Piece(inputs, t, h, courses_from_document(document))
    except (struct.error, ValueError, ZstdError, WireError) as error:
        raise CheckpointError(f"`{path}` is damaged: {error}") from error


def _inputs(connectors: Mapping[str, Connector]) -> dict[str, Connector]:
    return {n: c for n, c in connectors.items() if c.causality is Causality.INPUT}
