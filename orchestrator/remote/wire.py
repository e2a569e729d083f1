"""Signals as bytes: lossless, bit for bit, and decoded without a copy.

A message carries values only; names, element types and contents are known to both ends from
the connectors. A value that is *the same object* as the one sent before is not sent again: it
is marked unchanged, and the receiver hands out the object it decoded before. Components that
skip work for an unchanged input (`is`) therefore skip it in another process as well.
Where both ends share memory, a large value is put there and its place travels.

Layout of a block of signals; integers are unsigned and little-endian, every item is padded to
16 bytes so that decoded arrays are aligned:

    block: count u32 | 12 bytes zero | entry * count
    entry: index u16 | form u8 | rank u8 | 0 u32 | data length u64
           [16 bytes element type, NumPy's text, if form is FOREIGN]
           length of each axis u64 * rank | padding
           data | padding; if form is PLACED or PLACED_BINARY: place u64 | 8 bytes zero
"""

import math
import re
import struct
from collections.abc import Mapping
from typing import Any, Final

import numpy as np
from typing_extensions import Buffer

from orchestrator.errors import CosimError
from orchestrator.remote.segment import PlaceError
from orchestrator.remote.sharing import NOTHING_SHARED, SharedMemory
from orchestrator.signal import Array, Connector, Signal, Signals

_COUNT: Final = struct.Struct("<I12x")
_ENTRY: Final = struct.Struct("<HBBIQ")
_TYPE: Final = struct.Struct("<16s")
_PLACE: Final = struct.Struct("<Q8x")
_MAX_RANK: Final = 32
_PADDING: Final = tuple(bytes(-length % 16) for length in range(16))
_TRAVELLING: Final = re.compile(r"[<>|][biufcSUmM][1-9]\d{0,8}(\[\d*[A-Za-z]+\])?")
"""`dtype.str` of elements that are plain bytes and fully described by it."""


class WireError(CosimError):
    """Bytes are not a message, or a value cannot become one."""


# How an entry carries its value. Plain integers: an `Enum` costs more than the rest of an entry.
_UNCHANGED: Final = 0  # not at all: it is the object that was sent last
_DECLARED: Final = 1  # as an array of the element type that the connector declares
_FOREIGN: Final = 2  # as an array of another element type; the receiver will want to complain
_BINARY: Final = 3  # as bytes
_PLACED: Final = 4  # as the place of an array of the declared element type in shared memory
_PLACED_BINARY: Final = 5  # as the place of bytes in shared memory


def padding(length: int) -> bytes:
    """The zeros that follow `length` bytes."""
    return _PADDING[length % 16]


class SignalEncoder:
    """Encodes the signals that travel in one direction to one peer.

    Args:
        connectors: what may travel, by name; both ends need the same ones in the same order.
        memory: what the peer sees as well.
    """

    __slots__ = ("_index", "_last", "_memory", "_types", "_unchanged")

    def __init__(
        self, connectors: Mapping[str, Connector], memory: SharedMemory = NOTHING_SHARED
    ) -> None:
        self._memory = memory
        self._index = {name: index for index, name in enumerate(connectors)}
        self._types = _types(connectors)
        self._last: list[Signal | None] = [None] * len(connectors)
        self._unchanged = [_ENTRY.pack(i, _UNCHANGED, 0, 0, 0) for i in range(len(connectors))]

    def parts(self, signals: Signals) -> list[Buffer]:
        """The block that carries `signals`, as buffers to be joined once.

        Raises:
            WireError: a name is not declared, or a value is neither an array nor bytes. The
                encoder cannot be used any more, because its peer did not see what it saw.
        """
        block: list[Buffer] = [_COUNT.pack(len(signals))]
        for name, value in signals.items():
            index = self._index.get(name)
            if index is None:
                raise WireError(f"`{name}` is not a connector of that causality")
            if value is self._last[index]:
                block.append(self._unchanged[index])
                continue
            self._last[index] = value
            block += self._value_parts(index, name, value)
        return block

    def _value_parts(self, index: int, name: str, value: Any) -> tuple[Buffer, ...]:
        if isinstance(value, bytes):
            length = len(value)
            if length < self._memory.least:
                return _ENTRY.pack(index, _BINARY, 0, 0, length), value, padding(length)
            head = _ENTRY.pack(index, _PLACED_BINARY, 0, 0, length)
            return head, _PLACE.pack(self._memory.place(value))
        if (
            isinstance(value, np.ndarray)
            and value.nbytes >= self._memory.least
            and value.dtype == self._types[index]
        ):
            head = _DECLARED_HEADS[value.ndim].pack(
                index, _PLACED, value.ndim, 0, value.nbytes, *value.shape
            )
            return head, _PLACE.pack(self._memory.place(value))
        return _array_parts(index, name, value, self._types[index])


class SignalDecoder:
    """Decodes what a `SignalEncoder` with the same connectors encoded, message by message."""

    __slots__ = ("_last", "_memory", "_names", "_types")

    def __init__(
        self, connectors: Mapping[str, Connector], memory: SharedMemory = NOTHING_SHARED
    ) -> None:
        self._memory = memory
        self._names = tuple(connectors)
        self._types = _types(connectors)
        self._last: list[Signal | None] = [None] * len(connectors)

    def decode(self, message: bytes, offset: int = 0) -> dict[str, Signal]:
        """The signals in the block from `offset` to the end of `message`.

        Arrays are read-only views of `message`, which therefore lives as long as they do, or of
        shared memory, which is theirs as long.

        Raises:
            WireError: the bytes are not a block of these connectors' signals. The decoder cannot
                be used any more.
        """
        decoded: dict[str, Signal] = {}
        value: Signal | None
        try:
            (count,) = _COUNT.unpack_from(message, offset)
            offset += 16
            for _ in range(count):
                index, form, rank, _reserved, length = _ENTRY.unpack_from(message, offset)
                offset += 16
                name = self._name(index, decoded)
                if form == _UNCHANGED:
                    value = self._last[index]
                    if value is None:
                        raise WireError(f"signal `{name}` is unchanged, but was never sent")
                elif form == _BINARY:
                    after = _after(message, offset, length)
                    value = message[offset : offset + length]
                    offset = after
                elif form == _PLACED_BINARY:
                    (place,) = _PLACE.unpack_from(message, offset)
                    value = self._memory.read(place, length)
                    offset += 16
                elif form == _PLACED:
                    value, offset = self._placed_array(message, offset, index, rank, length)
                else:
                    dtype = self._element_type(message, offset, index, form)
                    if form == _FOREIGN:
                        offset += _TYPE.size
                    value, offset = _read_array(message, offset, dtype, rank, length)
                self._last[index] = decoded[name] = value
        except struct.error:
            raise WireError(f"a message of {len(message)} bytes ends too early") from None
        except PlaceError as error:
            raise WireError(str(error)) from None
        if offset != len(message):
            raise WireError(f"the signals end at byte {offset} of {len(message)}")
        return decoded

    def _placed_array(
        self, message: bytes, offset: int, index: int, rank: int, length: int
    ) -> tuple[Array, int]:
        dtype = self._element_type(message, offset, index, _DECLARED)
        shape, offset = _read_shape(message, offset, dtype, rank, length)
        (place,) = _PLACE.unpack_from(message, offset)
        return self._memory.array(place, shape, dtype), offset + 16

    def _name(self, index: int, decoded: Signals) -> str:
        if index >= len(self._names):
            raise WireError(f"signal {index} of {len(self._names)} does not exist")
        if self._names[index] in decoded:
            raise WireError(f"signal `{self._names[index]}` occurs twice")
        return self._names[index]

    def _element_type(self, message: bytes, offset: int, index: int, form: int) -> "np.dtype[Any]":
        if form == _FOREIGN:
            return _read_dtype(message, offset)
        if form != _DECLARED:
            raise WireError(f"signal `{self._names[index]}` has the unknown form {form}")
        dtype = self._types[index]
        if dtype is None:
            raise WireError(f"signal `{self._names[index]}` is an array, but declared binary")
        return dtype


def _types(connectors: Mapping[str, Connector]) -> "list[np.dtype[Any] | None]":
    return [None if c.is_binary else np.dtype(c.dtype) for c in connectors.values()]


def _heads(with_type: str) -> tuple[struct.Struct, ...]:
    """Entry and lengths of the axes, for every rank."""
    return tuple(
        struct.Struct(f"<HBBIQ{with_type}{rank}Q{8 * (rank % 2)}x") for rank in range(_MAX_RANK + 1)
    )


_DECLARED_HEADS: Final = _heads("")
_FOREIGN_HEADS: Final = _heads("16s")
_SHAPES: Final = tuple(struct.Struct(f"<{rank}Q") for rank in range(_MAX_RANK + 1))


def _array_parts(
    index: int, name: str, value: Any, declared: "np.dtype[Any] | None"
) -> tuple[Buffer, ...]:
    if not isinstance(value, np.ndarray):
        raise WireError(
            f"`{name}` is {type(value).__name__}, neither an array nor bytes; "
            "write `np.asarray(...)`"
        )
    # `ascontiguousarray` would turn rank 0 into rank 1
    data = value if value.flags.c_contiguous else value.copy(order="C")
    length = data.nbytes
    rank = data.ndim
    dtype = data.dtype
    if dtype == declared:
        head = _DECLARED_HEADS[rank].pack(index, _DECLARED, rank, 0, length, *data.shape)
    else:
        text = dtype.str.encode()
        if not _TRAVELLING.fullmatch(dtype.str) or len(text) > _TYPE.size:
            raise WireError(f"`{name}` has elements of type {dtype}, which cannot travel")
        head = _FOREIGN_HEADS[rank].pack(index, _FOREIGN, rank, 0, length, text, *data.shape)
    if dtype.kind in "mM":
        data = data.view(np.int64)  # the buffer protocol does not know times
    return head, data.data, _PADDING[length % 16]


def _read_dtype(message: bytes, offset: int) -> "np.dtype[Any]":
    (raw,) = _TYPE.unpack_from(message, offset)
    text = raw.rstrip(b"\0").decode("latin-1")
    try:
        if _TRAVELLING.fullmatch(text):
            dtype: np.dtype[Any] = np.dtype(text)
            return dtype
    except (TypeError, ValueError):
        pass
    raise WireError(f"{text!r} is not an element type")


def _read_shape(
    message: bytes, offset: int, dtype: "np.dtype[Any]", rank: int, length: int
) -> tuple[tuple[int, ...], int]:
    if rank > _MAX_RANK:
        raise WireError(f"an array of rank {rank}")
    shape = _SHAPES[rank].unpack_from(message, offset)
    offset += (8 * rank + 15) & -16
    if math.prod(shape) * dtype.itemsize != length:
        raise WireError(f"{length} bytes cannot be an array of {dtype}{list(shape)}")
    return shape, offset


def _read_array(
    message: bytes, offset: int, dtype: "np.dtype[Any]", rank: int, length: int
) -> tuple[Array, int]:
    shape, offset = _read_shape(message, offset, dtype, rank, length)
    after = _after(message, offset, length)
    try:
        if length == 0:
            empty = np.empty(shape, dtype)
            empty.flags.writeable = False
            return empty, after
        flat = np.frombuffer(message, dtype, length // dtype.itemsize, offset)
        return (flat if rank == 1 else flat.reshape(shape)), after
    except ValueError as error:
        raise WireError(f"an array of {dtype}{list(shape)}: {error}") from None


def _after(message: bytes, offset: int, length: int) -> int:
    """The offset of what follows `length` bytes and their padding."""
    after = offset + ((length + 15) & -16)
    if after > len(message):
        raise WireError(f"a message of {len(message)} bytes ends too early")
    return after
