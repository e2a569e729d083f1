"""The messages of a tap: what a run says of its signals while it goes on, and how a file keeps it.

A message has the layout of those between a run and its components (docs/wire-format.md), with a
magic number, a version and kinds of its own, so that either can change without the other:

    header: magic 4 bytes | version u16 | kind u16 | left out u32 | document length u32
            points u64 | t i64 | wall time i64 | 8 bytes zero
    document, padded to 16 bytes
    block of signals (`orchestrator.remote.wire`), or nothing

The first message is a schema; those with values follow, and an end, if the run came to one. A file
has a u64 with the length of each message before it.
"""

import enum
import json
import struct
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import IO, Any, Final

import numpy as np

from orchestrator.errors import in_words
from orchestrator.remote.block import WireError, element_type, padding
from orchestrator.remote.wire import SignalDecoder, SignalEncoder
from orchestrator.signal import Causality, Connector, Signals
from orchestrator.timebase import Time

HEADER: Final = struct.Struct("<4sHHIIQqq8x")
MAGIC: Final = b"NTAP"
VERSION: Final = 1

PUBLISHED: Final = "(published)"
"""A signal of the tap itself: when each component published last [ns], int64, (component,)."""

PUBLICATIONS: Final = "(publications)"
"""A signal of the tap itself: how often each component has, int64, (component,)."""

_LENGTH: Final = struct.Struct("<Q")
_LONGEST: Final = 1 << 32
"""A longer message in a file is a damaged one [byte]."""


class Kind(enum.IntEnum):
    """What a message says."""

    SCHEMA = 1
    VALUES = 2
    END = 3


_KINDS: Final = {kind.value: kind for kind in Kind}


@dataclass(frozen=True, slots=True, kw_only=True)
class Schema:
    """What a tap shows.

    Attributes:
        run: the name of the run.
        start, stop: its first and last communication point [ns].
        components: in the order of `PUBLISHED` and `PUBLICATIONS`.
        connectors: of the signals `component.connector`, in the order of their indices; first the
            tap's own.
        largest: larger values are not sent [byte]; `None`: all are.
    """

    run: str
    start: Time
    stop: Time
    components: tuple[str, ...]
    connectors: Mapping[str, Connector]
    largest: int | None = None

    @classmethod
    def of(
        cls,
        run: str,
        interval: tuple[Time, Time],
        components: Sequence[str],
        outputs: Mapping[str, Connector],
        largest: int | None = None,
    ) -> "Schema":
        """A schema with the tap's own signals before `outputs`."""
        own = Connector(causality=Causality.OUTPUT, dtype=np.int64, shape=("component",), unit="ns")
        counts = Connector(causality=Causality.OUTPUT, dtype=np.int64, shape=("component",))
        return cls(
            run=run,
            start=interval[0],
            stop=interval[1],
            components=tuple(components),
            connectors={PUBLISHED: own, PUBLICATIONS: counts, **outputs},
            largest=largest,
        )

    def to_document(self) -> dict[str, Any]:
        """The schema in terms of JSON."""
        return {
            "run": self.run,
            "start": self.start,
            "stop": self.stop,
            "components": list(self.components),
            "largest": self.largest,
            "signals": [
                {
                    "name": name,
                    # `str` rather than the name: it states the byte order
                    "dtype": None if each.is_binary else np.dtype(each.dtype).str,
                    "shape": list(each.shape),
                    "unit": each.unit,
                    "mime_type": each.mime_type,
                    "description": each.description,
                }
                for name, each in self.connectors.items()
            ],
        }

    @classmethod
    def from_document(cls, document: Mapping[str, Any]) -> "Schema":
        """What `to_document` described.

        Raises:
            WireError: the document is not a schema.
        """
        try:
            return cls(
                run=str(document["run"]),
                start=int(document["start"]),
                stop=int(document["stop"]),
                components=tuple(map(str, document["components"])),
                connectors={str(each["name"]): _connector(each) for each in document["signals"]},
                largest=None if document["largest"] is None else int(document["largest"]),
            )
        except (LookupError, TypeError, ValueError) as error:
            what = in_words(error)
            raise WireError(f"what a tap shows cannot be read: {what}") from None


@dataclass(frozen=True, slots=True, kw_only=True)
class Message:
    """A message of a tap.

    Attributes:
        kind: what it says.
        t: the communication point [ns].
        points: how many communication points there were so far.
        wall: wall time since the run began [ns].
        left_out: how many messages were not sent since the last one, because this reader was slow.
        document: a schema, or how the run ended.
        values: the signals.
    """

    kind: Kind
    t: Time = 0
    points: int = 0
    wall: int = 0
    left_out: int = 0
    document: Mapping[str, Any] | None = None
    values: Signals | None = None


class Writer:
    """Encodes the messages for one reader.

    Args:
        schema: of what it is shown.
    """

    def __init__(self, schema: Schema) -> None:
        self._schema = schema
        self._encoder = SignalEncoder(schema.connectors)

    def schema(self) -> bytes:
        """The first message."""
        return self.encode(Message(kind=Kind.SCHEMA, document=self._schema.to_document()))

    def encode(self, message: Message) -> bytes:
        """A message as bytes; whoever encodes it sends it, because the next one builds on it."""
        text = b"" if message.document is None else json.dumps(message.document).encode()
        header = HEADER.pack(
            MAGIC,
            VERSION,
            message.kind,
            min(message.left_out, 0xFFFFFFFF),
            len(text),
            message.points,
            message.t,
            message.wall,
        )
        block = () if message.values is None else self._encoder.parts(message.values)
        return b"".join((header, text, padding(len(text)), *block))


class Reader:
    """Decodes the messages for one reader, in their order."""

    def __init__(self) -> None:
        self.schema: Schema | None = None
        self._decoder: SignalDecoder | None = None

    def decode(self, raw: bytes) -> Message:
        """The next message; arrays are views of `raw`.

        Raises:
            WireError: the bytes are not a message of this version.
        """
        if len(raw) < HEADER.size:
            raise WireError(f"{len(raw)} bytes are too short for a message")
        magic, version, number, left_out, length, points, t, wall = HEADER.unpack_from(raw)
        if magic != MAGIC:
            raise WireError(f"a message of a tap starts with {MAGIC!r}, not {magic!r}")
        if version != VERSION:
            raise WireError(f"the tap speaks version {version}, this is version {VERSION}")
        if number not in _KINDS:
            raise WireError(f"a message of the unknown kind {number}")
        kind = _KINDS[number]
        offset = HEADER.size + length + len(padding(length))
        document = _document(raw, length) if length else None
        if kind is Kind.SCHEMA:
            self.schema = Schema.from_document(document or {})
            self._decoder = SignalDecoder(self.schema.connectors)
        if self._decoder is None:
            raise WireError("values came before what they are of")
        values = self._decoder.decode(raw, offset) if kind is Kind.VALUES else None
        return Message(
            kind=kind,
            t=t,
            points=points,
            wall=wall,
            left_out=left_out,
            document=document,
            values=values,
        )


def append(file: IO[bytes], raw: bytes) -> None:
    """Write a message to a file."""
    file.write(_LENGTH.pack(len(raw)) + raw)


def messages(file: IO[bytes]) -> Iterator[bytes]:
    """The messages in a file; one that was cut off at its end is left out.

    Raises:
        WireError: the file is not one of messages.
    """
    while len(head := file.read(_LENGTH.size)) == _LENGTH.size:
        (length,) = _LENGTH.unpack(head)
        if not HEADER.size <= length < _LONGEST:
            raise WireError(f"a message of {length} bytes in a file")
        raw = file.read(length)
        if len(raw) < length:
            return
        yield raw


def _document(raw: bytes, length: int) -> Mapping[str, Any]:
    try:
        document = json.loads(raw[HEADER.size : HEADER.size + length])
    except (ValueError, RecursionError) as error:
        raise WireError(f"a message cannot be read: {error}") from None
    if not isinstance(document, dict):
        raise WireError(f"a message carries {type(document).__name__}, not an object")
    return document


def _connector(document: Mapping[str, Any]) -> Connector:
    return Connector(
        causality=Causality.OUTPUT,
        dtype=None if document["dtype"] is None else element_type(document["dtype"]),
        shape=tuple(document["shape"]),
        unit=document["unit"],
        mime_type=document["mime_type"],
        description=document["description"],
    )
