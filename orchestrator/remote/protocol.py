"""What the orchestrator and the host of a component say to each other.

One command, one reply. A message is a header, a JSON document (empty in most steps) and a
block of signals: the inputs travel inside the step command, the outputs inside its reply. Numbers
of fixed size may be laid out once and not described any more (`orchestrator.remote.laid_out`).

    header: magic 4 bytes | version u16 | kind u16 | epoch u32 | document length u32
            sequence u64 | t i64 | h i64 | 8 bytes zero
    document, padded to 16 bytes
    block of signals (`orchestrator.remote.wire`), or nothing
"""

import enum
import json
import struct
from collections.abc import Mapping, Sequence
from fractions import Fraction
from types import MappingProxyType
from typing import Any, Final, NamedTuple

import numpy as np
from typing_extensions import Buffer

from orchestrator.capabilities import (
    CourseFollowing,
    EndRequesting,
    InitialEvaluation,
    OutputSelection,
    OutputSlopes,
    PointEvaluation,
    PortableState,
    VariableSteps,
)
from orchestrator.remote.block import WireError, padding
from orchestrator.timebase import CommunicationGrid, as_step_size

_HEADER: Final = struct.Struct("<4sHHIIQqq8x")
HEADER_SIZE: Final = _HEADER.size
SEQUENCE: Final = 16
STEP: Final = struct.Struct("<qq")
"""The communication point and the step size of a command, behind its sequence number."""

_MAGIC: Final = b"NLOS"
VERSION: Final = 5
"""The version of messages; both ends must have the same."""

CAPABILITIES: Final[Mapping[str, type]] = {
    each.__name__: each
    for each in (
        CourseFollowing,
        EndRequesting,
        InitialEvaluation,
        OutputSelection,
        OutputSlopes,
        PointEvaluation,
        PortableState,
        VariableSteps,
    )
}
"""What a component in another process can do as well as here, by name."""


class Kind(enum.IntEnum):
    """What a message asks for, or how it answers."""

    CREATE = 1
    SETUP = 2
    INITIALISE = 3
    STEP = 4
    CLOSE = 5
    SAVE = 6
    RESTORE = 7
    EVALUATE = 8
    DUMP = 9
    LOAD = 10
    SLOPES = 11
    SELECT = 12
    LAY_OUT = 13
    STEP_LAID_OUT = 14
    DONE = 16
    FAILED = 17


_POOL: Final = np.random.SeedSequence(0).pool_size
"""Words from which random streams of runs are made."""

_KINDS: Final = {kind.value: kind for kind in Kind}
_NOTHING: Final[Mapping[str, Any]] = MappingProxyType({})


class Message(NamedTuple):
    """A message without its signals; a tuple, because four are made for each remote step.

    Attributes:
        kind: what it asks for.
        epoch: counts the runs (`setup`) of one component; a reply echoes its command's.
        sequence: counts the commands to one component; a reply echoes its command's.
        t: the communication point [ns].
        h: the communication step size [ns].
        document: whatever is not a signal; must be representable in JSON.
    """

    kind: Kind
    epoch: int
    sequence: int
    t: int = 0
    h: int = 0
    document: Mapping[str, Any] = _NOTHING

    def encode(self, block: Sequence[Buffer] = ()) -> bytes:
        """The message with a block of signals, joined in one copy."""
        if not self.document:
            return b"".join((self._header(0), *block))
        text = json.dumps(self.document).encode()
        return b"".join((self._header(len(text)), text, padding(len(text)), *block))

    def _header(self, length: int) -> bytes:
        kind, epoch, sequence, t, h, _ = self
        return _HEADER.pack(_MAGIC, VERSION, kind, epoch, length, sequence, t, h)

    @classmethod
    def decode(cls, message: bytes) -> tuple["Message", int]:
        """The message, and the offset at which its signals begin.

        Raises:
            WireError: the bytes are not a message of this version of the protocol.
        """
        if len(message) < _HEADER.size:
            raise WireError(f"{len(message)} bytes are too short for a message")
        magic, version, number, epoch, length, sequence, t, h = _HEADER.unpack_from(message)
        kind = _KINDS.get(number)
        if magic != _MAGIC:
            raise WireError(f"a message starts with {_MAGIC!r}, not {magic!r}")
        if version != VERSION:
            raise WireError(
                f"the peer speaks version {version} of the protocol, this is version {VERSION}; "
                "install the same release at both ends"
            )
        if kind is None:
            raise WireError(f"a message of the unknown kind {number}")
        if not length:
            return cls(kind, epoch, sequence, t, h), _HEADER.size
        decoded = cls(kind, epoch, sequence, t, h, _document(message, length))
        return decoded, _HEADER.size + length + len(padding(length))

    def reply(self, kind: Kind, document: Mapping[str, Any]) -> "Message":
        """A reply to this command."""
        return Message(kind, self.epoch, self.sequence, document=document)


def generator_to_document(rng: np.random.Generator) -> dict[str, Any]:
    """The exact state of a random stream, and what its children derive from."""
    bits = rng.bit_generator
    seeds = bits.seed_seq
    if not isinstance(bits, np.random.PCG64) or not isinstance(seeds, np.random.SeedSequence):
        raise TypeError(f"a generator of type {type(bits).__name__} cannot travel, only PCG64")
    return {"state": _integers(bits.state), "seeds": _integers(seeds.state)}


def grid_to_document(grid: CommunicationGrid | None) -> dict[str, Any] | None:
    """Communication points as a document; `None` of none."""
    if grid is None:
        return None
    step = Fraction(grid.step_size)
    return {"start": grid.start, "step": [step.numerator, step.denominator], "count": grid.count}


def grid_from_document(document: Mapping[str, Any] | None) -> CommunicationGrid | None:
    """What `grid_to_document` wrote."""
    if document is None:
        return None
    step = as_step_size(Fraction(*document["step"]))
    return CommunicationGrid(document["start"], step, document["count"])


def generator_from_document(document: Mapping[str, Any]) -> np.random.Generator:
    """A generator that continues exactly as the one that was described.

    Raises:
        ValueError: it is described otherwise than `generator_to_document` does.
    """
    if document["seeds"].get("pool_size") != _POOL:  # NumPy takes memory and hours for a large one
        raise ValueError(f"a random stream has a pool of {_POOL} words")
    bits = np.random.PCG64(np.random.SeedSequence(**document["seeds"]))
    bits.state = document["state"]
    return np.random.Generator(bits)


def _document(message: bytes, length: int) -> Mapping[str, Any]:
    start = _HEADER.size
    if start + length + len(padding(length)) > len(message):
        raise WireError(f"a message of {len(message)} bytes ends too early")
    try:
        document = json.loads(message[start : start + length])
    except (ValueError, RecursionError) as error:
        raise WireError(f"a message cannot be read: {error}") from None
    if not isinstance(document, dict):
        raise WireError(f"a message carries {type(document).__name__}, not an object")
    return document


def _integers(state: Any) -> Any:
    """`state` with NumPy's integers and arrays turned into Python's."""
    match state:
        case Mapping():
            return {key: _integers(value) for key, value in state.items()}
        case np.ndarray() | list() | tuple():
            return [_integers(item) for item in state]
        case np.integer():
            return int(state)
    return state
