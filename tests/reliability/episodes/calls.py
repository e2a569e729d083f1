"""The calls of an episode as bytes that player.c reads."""

import enum
import struct
from collections.abc import Mapping
from typing import Final

import numpy as np

from fmus.native.interface import Variable
from fmus.native.unit import load_unit
from orchestrator.signal import Array

_CALL: Final = struct.Struct("<IIIIddQ")
_EPISODE: Final = struct.Struct("<II")

CHANGE: Final = np.dtype([("place", "<f8"), ("kind", "<u4"), ("pad", "<u4"), ("value", "<u8")])
"""A change of a kept state; player.c has the same layout."""

CHANGE_KINDS: Final = 5

_TYPES: Final = {
    "Float32": (0, np.float32),
    "Float64": (1, np.float64),
    "Int8": (2, np.int8),
    "UInt8": (3, np.uint8),
    "Int16": (4, np.int16),
    "UInt16": (5, np.uint16),
    "Int32": (6, np.int32),
    "UInt32": (7, np.uint32),
    "Int64": (8, np.int64),
    "UInt64": (9, np.uint64),
    "Boolean": (10, np.uint8),
    "Enumeration": (8, np.int64),
}


class What(enum.IntEnum):
    """What is called; player.c has the same numbers."""

    NEW = 0
    FREE = 1
    SET = 2
    SET_BINARY = 3
    GET = 4
    GET_BINARY = 5
    CHANGE_MODE = 6
    INITIALISE = 7
    ADVANCE = 8
    KEEP = 9
    DAMAGE = 10
    RETURN = 11
    FEED = 12
    UNKNOWN = 13


class Mode(enum.IntEnum):
    """Functions without arguments; player.c has the same numbers."""

    CONFIGURE = 0
    CONFIGURED = 1
    INITIALISED = 2
    EVENT = 3
    UPDATE = 4
    STEP = 5
    TERMINATE = 6
    RESET = 7
    LOGGING = 8
    UNSUPPORTED = 9


class Table:
    """The variables of a unit, by name, with their references."""

    def __init__(self, unit: str) -> None:
        """Look the unit of this name up."""
        self.unit = unit
        self.variables: Mapping[str, Variable] = {
            variable.name: variable for variable in load_unit(unit).interface.variables
        }
        self.references = {name: k for k, name in enumerate(self.variables, start=1)}

    def of(self, *causalities: str) -> list[Variable]:
        """The variables of these causalities."""
        return [v for v in self.variables.values() if v.causality in causalities]


class Calls:
    """The calls of one episode, one after the other."""

    def __init__(self, table: Table) -> None:
        """An episode of the unit that `table` describes, without a call yet."""
        self.table = table
        self._parts: list[bytes] = []

    def add(
        self,
        what: What,
        instance: int = 0,
        reference: int = 0,
        *,
        kind: int = 0,
        a: float = 0.0,
        b: float = 0.0,
        data: bytes = b"",
    ) -> None:
        """One more call; see player.c for what it makes of its numbers."""
        self._parts.append(_CALL.pack(what, instance, reference, kind, a, b, len(data)) + data)

    def mode(self, instance: int, mode: Mode) -> None:
        """Call a function without arguments."""
        self.add(What.CHANGE_MODE, instance, mode)

    def set(self, instance: int, name: str, value: Array | bytes | float) -> None:
        """Set a variable, to elements of its type or to bytes."""
        variable, reference = self.table.variables[name], self.table.references[name]
        if isinstance(value, bytes):
            self.add(What.SET_BINARY, instance, reference, data=value)
            return
        kind, dtype = _TYPES[variable.type]
        with np.errstate(all="ignore"):
            data = np.ravel(np.asarray(value)).astype(dtype).tobytes()
        self.add(What.SET, instance, reference, kind=kind, data=data)

    def get(self, instance: int, name: str, count: int) -> None:
        """Get so many elements of a variable, or its bytes."""
        variable, reference = self.table.variables[name], self.table.references[name]
        if variable.type == "Binary":
            self.add(What.GET_BINARY, instance, reference)
        else:
            self.add(What.GET, instance, reference, kind=_TYPES[variable.type][0], a=count)

    def feed(self, source: int, output: str, target: int, name: str) -> None:
        """Let the bytes of an output be those of an input."""
        references = self.table.references
        self.add(What.FEED, source, references[output], kind=references[name], a=target)

    def bytes(self, number: int) -> bytes:
        """The whole episode, called `number`."""
        return _EPISODE.pack(number, len(self._parts)) + b"".join(self._parts)
