"""Values of a run as bytes: numbers, texts, bytes and arrays, in lists and mappings.

Bit for bit; and what was the same object in several places is one object again, for receivers skip
work where a value is the object that they had. No code is loaded from it, whatever it says.

    u64 length of the document | document, JSON | data of arrays and bytes, one after the other
"""

import json
import struct
from collections.abc import Mapping
from typing import Any, Final

import numpy as np

from orchestrator.errors import CosimError

_LENGTH: Final = struct.Struct("<Q")

_NO_VALUES: Final = (
    struct.error, ValueError, LookupError, TypeError, AttributeError, OverflowError, RecursionError,
    SyntaxError,
)  # fmt: skip
"""What comes of reading bytes that are something else; a type such as `,` is wrong syntax."""


class PackingError(CosimError):
    """A value cannot become bytes, or bytes are no packed values."""


def packed(value: Any) -> bytes:
    """`value` as bytes.

    Args:
        value: `None`, a truth value, a number, a text, bytes, an array of plain elements, or a
            list, a tuple (which becomes a list) or a mapping by texts of such values.

    Raises:
        PackingError: it is something else.
    """
    packing = _Packing()
    document = json.dumps({"value": packing.plain(value), "data": packing.described}).encode()
    return b"".join((_LENGTH.pack(len(document)), document, *packing.data))


def unpacked(content: bytes) -> Any:
    """What `packed` made bytes of; arrays are read-only.

    Raises:
        PackingError: these are no such bytes.
    """
    try:
        (length,) = _LENGTH.unpack_from(content)
        document = json.loads(content[_LENGTH.size : _LENGTH.size + length])
        at, found = _LENGTH.size + length, []
        for described in document["data"]:
            end = at + described["bytes"]
            found.append(_read(content[at:end], described))
            at = end
        return _restored(document["value"], found)
    except _NO_VALUES as error:
        raise PackingError(f"these bytes are no packed values: {error}") from None


class _Packing:
    """Puts data aside, each object once."""

    def __init__(self) -> None:
        self.described: list[dict[str, Any]] = []
        self.data: list[bytes] = []
        self._known: dict[int, tuple[int, Any]] = {}  # the object is kept, so is its number

    def plain(self, value: Any) -> Any:
        """`value` as JSON; what is data in it becomes its place."""
        match value:
            case None | bool() | int() | float() | str():
                return value
            case bytes() | np.ndarray():
                return {"at": self._place(value)}
            case list() | tuple():
                return [self.plain(each) for each in value]
            case Mapping():
                return {"of": {_text(name): self.plain(each) for name, each in value.items()}}
            case _:
                raise PackingError(f"a {type(value).__name__} cannot be written down")

    def _place(self, value: Any) -> int:
        if id(value) not in self._known:
            self._known[id(value)] = (len(self.data), value)
            data, described = _described(value)
            self.data.append(data)
            self.described.append({"bytes": len(data), **described})
        return self._known[id(value)][0]


def _text(name: object) -> str:
    if isinstance(name, str):
        return name
    raise PackingError(f"a mapping by {type(name).__name__} cannot be written down")


def _described(value: Any) -> tuple[bytes, dict[str, Any]]:
    if isinstance(value, bytes):
        return value, {}
    if value.dtype.hasobject or value.dtype.names is not None:
        raise PackingError(f"an array of {value.dtype} cannot be written down")
    return value.tobytes(), {"type": value.dtype.str, "shape": list(value.shape)}


def _read(data: bytes, described: Mapping[str, Any]) -> Any:
    if "type" not in described:
        return data
    text = described["type"]
    if not isinstance(text, str):
        raise TypeError(f"an array of {text}")
    dtype = np.dtype(text)
    if dtype.hasobject or dtype.names is not None:
        raise ValueError(f"an array of {dtype}")
    return np.ndarray(tuple(described["shape"]), dtype, data)


def _restored(plain: Any, data: list[Any]) -> Any:
    match plain:
        case {"at": int(place)}:
            return data[place]
        case {"of": dict(values)}:
            return {name: _restored(each, data) for name, each in values.items()}
        case list():
            return [_restored(each, data) for each in plain]
        case _:
            return plain
