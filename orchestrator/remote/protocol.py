"""What the orchestrator and the host of a component say to each other.

One command, one reply. A message is a header, a JSON document (empty in most steps) and a
block of signals: the inputs travel inside the step command, the outputs inside its reply.

    header: magic 4 bytes | version u16 | kind u16 | epoch u32 | document length u32
            sequence u64 | t i64 | h i64 | 8 bytes zero
    document, padded to 16 bytes
    block of signals (`orchestrator.remote.wire`), or nothing
"""

import dataclasses
import enum
import importlib
import json
import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final, NamedTuple

import numpy as np
from typing_extensions import Buffer

from orchestrator.capabilities import (
    CourseFollowing,
    EndRequest,
    EndRequesting,
    InitialEvaluation,
    OutputSlopes,
    PointEvaluation,
    PortableState,
    VariableSteps,
)
from orchestrator.errors import ComponentTypeError
from orchestrator.kinds import FrozenMapping
from orchestrator.local_module import local_type
from orchestrator.parameters import DRAWN
from orchestrator.remote.wire import SignalDecoder, SignalEncoder, WireError, padding
from orchestrator.signal import Causality, Connector, Variability
from orchestrator.timebase import CommunicationGrid, as_step_size
from orchestrator.units import Unit

_HEADER: Final = struct.Struct("<4sHHIIQqq8x")
_MAGIC: Final = b"NLOS"
_VERSION: Final = 3


CAPABILITIES: Final[Mapping[str, type]] = {
    each.__name__: each
    for each in (
        CourseFollowing,
        EndRequesting,
        InitialEvaluation,
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
    DONE = 16
    FAILED = 17


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
        text = b"" if not self.document else json.dumps(self.document).encode()
        header = _HEADER.pack(
            _MAGIC, _VERSION, self.kind, self.epoch, len(text), self.sequence, self.t, self.h
        )
        return b"".join((header, text, padding(len(text)), *block))

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
        if version != _VERSION:
            raise WireError(
                f"the peer speaks version {version} of the protocol, this is version {_VERSION}; "
                "install the same release at both ends"
            )
        if kind is None:
            raise WireError(f"a message of the unknown kind {number}")
        document = _document(message, length) if length else _NOTHING
        decoded = cls(kind=kind, epoch=epoch, sequence=sequence, t=t, h=h, document=document)
        return decoded, _HEADER.size + length + len(padding(length))

    def reply(self, kind: Kind, document: Mapping[str, Any]) -> "Message":
        """A reply to this command."""
        return Message(kind=kind, epoch=self.epoch, sequence=self.sequence, document=document)


@dataclass(frozen=True, slots=True, kw_only=True)
class ComponentSpec:
    """What the host of a component needs to create it.

    Attributes:
        name: of the component in its system.
        type: the name of an installed component type; or `module:Class`; or the same with the path
            of a file, `/path/module.py:Class`; or the path of an FMU, as a `Path`.
        values: parameter values, as `ComponentType.create` wants them: bool, int, float,
            str, `Path`, records, distributions, and tuples and mappings of these.
    """

    name: str
    type: str | Path
    values: Mapping[str, Any]

    def to_document(self) -> dict[str, Any]:
        """The specification in terms of JSON.

        Raises:
            ComponentTypeError: a value cannot travel.
        """
        values = {}
        for name, value in self.values.items():
            try:
                values[name] = _plain(value)
            except TypeError:
                raise ComponentTypeError(
                    f"component `{self.name}`: parameter `{name}` is {type(value).__name__}, "
                    "which cannot travel to another process"
                ) from None
        return {"name": self.name, "type": _plain(self.type), "values": values}

    @classmethod
    def from_document(cls, document: Mapping[str, Any]) -> "ComponentSpec":
        """What `to_document` described.

        Raises:
            ComponentTypeError: a record is not what the sender has; the releases differ.
        """
        kind = _rich(document["type"])
        if isinstance(kind, str) and kind.rpartition(":")[0].endswith(".py"):
            local_type(kind, Path())  # whose records may be among the values
        values = {name: _rich(value) for name, value in document["values"].items()}
        return cls(name=document["name"], type=kind, values=values)


def connectors_to_message(
    connectors: Mapping[str, Connector], command: Message, document: Mapping[str, Any]
) -> bytes:
    """A reply to `command` that describes `connectors`; start values travel as signals.

    Args:
        connectors: by name.
        command: what is answered.
        document: what else the reply says.
    """
    described = {name: _describe(connector) for name, connector in connectors.items()}
    starts = {
        name: c.start if isinstance(c.start, bytes) else np.asarray(c.start, c.dtype)
        for name, c in connectors.items()
        if c.start is not None
    }
    reply = command.reply(Kind.DONE, {**document, "connectors": described})
    return reply.encode(SignalEncoder(connectors).parts(starts))


def connectors_from_message(
    document: Mapping[str, Any], message: bytes, offset: int
) -> dict[str, Connector]:
    """What `connectors_to_message` described."""
    without_starts = {name: _connector(d) for name, d in document["connectors"].items()}
    starts = SignalDecoder(without_starts).decode(message, offset)
    return {
        name: _connector(d, start=starts.get(name)) for name, d in document["connectors"].items()
    }


def request_to_document(request: EndRequest | None) -> dict[str, Any]:
    """What a reply says of a request for the end of the run; nothing, if there is none."""
    return {} if request is None else {"end": {"time": request.time, "why": request.why}}


def request_from_document(document: Mapping[str, Any]) -> EndRequest | None:
    """What `request_to_document` described."""
    return EndRequest(**document["end"]) if "end" in document else None


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
    """A generator that continues exactly as the one that was described."""
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


def _describe(connector: Connector) -> dict[str, Any]:
    return {
        "causality": connector.causality.value,
        # `str` rather than the name: it states the byte order
        "dtype": None if connector.is_binary else np.dtype(connector.dtype).str,
        "shape": list(connector.shape),
        "unit": connector.unit,
        "definition": _definition(connector.definition),
        "is_relative": connector.is_relative,
        "variability": connector.variability.value,
        "mime_type": connector.mime_type,
        "feedthrough": sorted(connector.feedthrough),
        "description": connector.description,
        "needed": connector.needed,
        "parameter": list(connector.parameter),
    }


def _connector(document: Mapping[str, Any], start: Any = None) -> Connector:
    return Connector(
        causality=Causality(document["causality"]),
        dtype=None if document["dtype"] is None else np.dtype(document["dtype"]),
        shape=tuple(document["shape"]),
        unit=document["unit"],
        definition=_unit(document["definition"]),
        is_relative=document["is_relative"],
        variability=Variability(document["variability"]),
        start=start,
        mime_type=document["mime_type"],
        feedthrough=frozenset(document["feedthrough"]),
        description=document["description"],
        needed=document["needed"],
        parameter=tuple(document["parameter"]),
    )


def _definition(unit: Unit | None) -> dict[str, Any] | None:
    if unit is None:
        return None
    return {
        "symbol": unit.symbol,
        "factor": str(unit.factor),
        "exponents": list(unit.exponents),
        "offset": str(unit.offset),
    }


def _unit(document: Mapping[str, Any] | None) -> Unit | None:
    if document is None:
        return None
    return Unit(
        symbol=document["symbol"],
        factor=Fraction(document["factor"]),
        exponents=tuple(document["exponents"]),
        offset=Fraction(document["offset"]),
    )


def _plain(value: Any) -> Any:
    match value:
        case None | bool() | int() | float() | str():
            return value
        case Path():
            return {"path": str(value)}
        case tuple() | list():
            return {type(value).__name__: [_plain(item) for item in value]}
        case FrozenMapping():
            return {"mapping": {name: _plain(each) for name, each in value.items()}}
    if not _is_frozen(type(value)) or "<" in type(value).__qualname__:
        raise TypeError
    fields = {f.name: getattr(value, f.name) for f in dataclasses.fields(value)}
    return {
        "record": f"{type(value).__module__}:{type(value).__qualname__}",
        "fields": {name: _plain(each) for name, each in fields.items() if each is not DRAWN},
    }


def _rich(value: Any) -> Any:
    match value:
        case {"path": text}:
            return Path(text)
        case {"tuple": items}:
            return tuple(map(_rich, items))
        case {"list": items}:
            return list(map(_rich, items))
        case {"mapping": entries}:
            return FrozenMapping({name: _rich(each) for name, each in entries.items()})
        case {"record": reference, "fields": fields}:
            return _record(reference, {name: _rich(each) for name, each in fields.items()})
    return value


def _record(reference: str, fields: Mapping[str, Any]) -> Any:
    """A frozen dataclass, `module:Class`, with these fields."""
    module, _, names = reference.partition(":")
    try:
        found: Any = importlib.import_module(module)
        for name in names.split("."):
            found = getattr(found, name)
        if not _is_frozen(found):
            raise ComponentTypeError(f"`{reference}` is not a record")
        return found(**fields)
    except (ImportError, AttributeError, TypeError, ValueError) as error:
        kind = type(error).__name__
        what = f"cannot make a `{reference}`: {kind}: {error}; install the same release here"
        raise ComponentTypeError(what) from error


def _is_frozen(kind: Any) -> bool:
    is_dataclass = isinstance(kind, type) and dataclasses.is_dataclass(kind)
    return is_dataclass and kind.__dataclass_params__.frozen


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
