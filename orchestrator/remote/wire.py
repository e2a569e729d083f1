"""Signals as bytes: lossless, bit for bit, and decoded without a copy.

A message carries values only; names, element types and contents are known to both ends from
the connectors. A value that is *the same object* as the one sent before is not sent again: it
is marked unchanged, and the receiver hands out the object it decoded before. Components that
skip work for an unchanged input (`is`) therefore skip it in another process as well.
Where both ends share memory, a large value is put there and its place travels. How that is laid out
says `orchestrator.remote.block`.
"""

import struct
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np
from typing_extensions import Buffer

from orchestrator.remote.block import (
    BINARY,
    COUNT,
    DECLARED,
    DECLARED_HEADS,
    ENTRY,
    FOREIGN,
    NAMED,
    PLACE,
    PLACED,
    PLACED_BINARY,
    TIMES,
    TYPE,
    UNCHANGED,
    WireError,
    array_parts,
    end_of,
    padding,
    read_array,
    read_dtype,
    read_shape,
)
from orchestrator.remote.segment import PlaceError
from orchestrator.remote.sharing import NOTHING_SHARED, SharedMemory
from orchestrator.signal import Array, Connector, Signal, Signals


class _Frame(NamedTuple):
    """What is around the data of an array: most arrays are like the one before them.

    Attributes:
        head: the entry, and the lengths of the axes.
        shape: of the array.
        dtype: of its elements, as declared.
        size: of them all [1].
        is_placed: whether their place follows, and not they.
        padding: behind the data.
    """

    head: bytes
    shape: tuple[int, ...]
    dtype: "np.dtype[Any]"
    size: int
    is_placed: bool
    padding: bytes

    @classmethod
    def of(cls, head: bytes, value: Array, *, is_placed: bool = False) -> "_Frame":
        """That of arrays like `value`, behind this head."""
        return cls(head, value.shape, value.dtype, value.size, is_placed, padding(value.nbytes))

    def read(self, message: bytes, offset: int, memory: SharedMemory) -> tuple[Array, int]:
        """The array whose entry begins at `offset`, and the offset of what follows it."""
        head, shape, dtype, size, is_placed, _ = self
        begin = offset + len(head)
        if is_placed:
            return memory.array(PLACE.unpack_from(message, begin)[0], shape, dtype), begin + 16
        after = end_of(message, begin, size * dtype.itemsize)
        flat = np.frombuffer(message, dtype, size, begin)
        return (flat if len(shape) == 1 else flat.reshape(shape)), after


class SignalEncoder:
    """Encodes the signals that travel in one direction to one peer.

    Args:
        connectors: what may travel, by name; both ends need the same ones in the same order.
        memory: what the peer sees as well.
        name_of: the name by which the peer knows a value; `None`: it does not. Without, it knows
            no names.
    """

    __slots__ = ("_frames", "_index", "_last", "_memory", "_name_of", "_types", "_unchanged")

    def __init__(
        self,
        connectors: Mapping[str, Connector],
        memory: SharedMemory = NOTHING_SHARED,
        name_of: Callable[[Signal], bytes | None] | None = None,
    ) -> None:
        self._memory = memory
        self._name_of = name_of
        self._index = {name: index for index, name in enumerate(connectors)}
        self._types = _types(connectors)
        self._last: list[Signal | None] = [None] * len(connectors)
        self._frames: list[_Frame | None] = [None] * len(connectors)
        self._unchanged = [ENTRY.pack(i, UNCHANGED, 0, 0, 0) for i in range(len(connectors))]

    def parts(self, signals: Signals) -> list[Buffer]:
        """The block that carries `signals`, as buffers to be joined once.

        Raises:
            WireError: a name is not declared, or a value is neither an array nor bytes. The
                encoder cannot be used any more, because its peer did not see what it saw.
        """
        block: list[Buffer] = [COUNT.pack(len(signals))]
        for name, value in signals.items():
            index = self._index.get(name)
            if index is None:
                raise WireError(f"`{name}` is not a connector of that causality")
            if value is self._last[index]:
                block.append(self._unchanged[index])
                continue
            self._last[index] = value
            frame = self._frames[index]
            if (
                frame is not None
                and type(value) is np.ndarray
                and value.shape == frame.shape
                and value.dtype is frame.dtype
                and self._name_of is None
                and (frame.is_placed or value.flags.c_contiguous)
            ):
                if frame.is_placed:
                    block += frame.head, PLACE.pack(self._memory.place(value))
                else:
                    block += frame.head, value.data, frame.padding
            else:
                block += self._value_parts(index, name, value)
        return block

    def _value_parts(self, index: int, name: str, value: Any) -> tuple[Buffer, ...]:
        named = None if self._name_of is None else self._name_of(value)
        if named is not None and (isinstance(value, bytes) or value.dtype == self._types[index]):
            return ENTRY.pack(index, NAMED, 0, 0, len(named)), named, padding(len(named))
        if isinstance(value, bytes):
            length = len(value)
            if length < self._memory.least:
                return ENTRY.pack(index, BINARY, 0, 0, length), value, padding(length)
            head = ENTRY.pack(index, PLACED_BINARY, 0, 0, length)
            return head, PLACE.pack(self._memory.place(value))
        if (
            isinstance(value, np.ndarray)
            and value.nbytes >= self._memory.least
            and value.dtype == self._types[index]
        ):
            head = DECLARED_HEADS[value.ndim].pack(
                index, PLACED, value.ndim, 0, value.nbytes, *value.shape
            )
            if value.dtype is self._types[index]:
                self._frames[index] = _Frame.of(head, value, is_placed=True)
            return head, PLACE.pack(self._memory.place(value))
        parts = array_parts(index, name, value, self._types[index])
        dtype: np.dtype[Any] = value.dtype
        self._frames[index] = (
            _Frame.of(bytes(parts[0]), value)
            if dtype is self._types[index] and dtype.kind not in TIMES
            else None
        )
        return parts


class SignalDecoder:
    """Decodes what a `SignalEncoder` with the same connectors encoded, message by message."""

    __slots__ = ("_frames", "_last", "_memory", "_names", "_types")

    def __init__(
        self, connectors: Mapping[str, Connector], memory: SharedMemory = NOTHING_SHARED
    ) -> None:
        self._frames: list[_Frame | None] = [None] * len(connectors)
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
        value: Signal
        try:
            (count,) = COUNT.unpack_from(message, offset)
            offset += 16
            for _ in range(count):
                head = ENTRY.unpack_from(message, offset)
                index = head[0]
                name = self._name(index, decoded)
                frame = self._frames[index]
                if frame is not None and message.startswith(frame.head, offset):
                    value, offset = frame.read(message, offset, self._memory)
                else:
                    value, offset = self._value(message, offset + 16, head)
                self._last[index] = decoded[name] = value
        except struct.error:
            raise WireError(f"a message of {len(message)} bytes ends too early") from None
        except PlaceError as error:
            raise WireError(str(error)) from None
        if offset != len(message):
            raise WireError(f"the signals end at byte {offset} of {len(message)}")
        return decoded

    def _value(
        self, message: bytes, offset: int, head: tuple[int, int, int, int, int]
    ) -> tuple[Signal, int]:
        """The value of the entry with this head, and the offset of what follows it."""
        index, form, rank, _reserved, length = head
        if form == UNCHANGED:
            last = self._last[index]
            if last is None:
                raise WireError(f"signal `{self._names[index]}` is unchanged, but was never sent")
            return last, offset
        if form == BINARY:
            after = end_of(message, offset, length)
            return message[offset : offset + length], after
        if form == PLACED_BINARY:
            (place,) = PLACE.unpack_from(message, offset)
            return self._memory.read(place, length, index), offset + 16
        if form == PLACED:
            return self._placed_array(message, offset, index, rank, length)
        dtype = self._element_type(message, offset, index, form)
        begin = offset + (TYPE.size if form == FOREIGN else 0)
        value, after = read_array(message, begin, dtype, rank, length)
        if form == DECLARED and length:
            entry = message[offset - 16 : offset + ((8 * rank + 15) & -16)]
            self._frames[index] = _Frame.of(entry, value)
        return value, after

    def _placed_array(
        self, message: bytes, offset: int, index: int, rank: int, length: int
    ) -> tuple[Array, int]:
        entry = offset - 16
        dtype = self._element_type(message, offset, index, DECLARED)
        shape, offset = read_shape(message, offset, dtype, rank, length)
        (place,) = PLACE.unpack_from(message, offset)
        value = self._memory.array(place, shape, dtype)
        self._frames[index] = _Frame.of(message[entry:offset], value, is_placed=True)
        return value, offset + 16

    def _name(self, index: int, decoded: Signals) -> str:
        if index >= len(self._names):
            raise WireError(f"signal {index} of {len(self._names)} does not exist")
        name = self._names[index]
        if name in decoded:
            raise WireError(f"signal `{name}` occurs twice")
        return name

    def _element_type(self, message: bytes, offset: int, index: int, form: int) -> "np.dtype[Any]":
        if form == FOREIGN:
            return read_dtype(message, offset)
        if form != DECLARED:
            raise WireError(f"signal `{self._names[index]}` has the unknown form {form}")
        dtype = self._types[index]
        if dtype is None:
            raise WireError(f"signal `{self._names[index]}` is an array, but declared binary")
        return dtype


def _types(connectors: Mapping[str, Connector]) -> "list[np.dtype[Any] | None]":
    return [None if c.is_binary else np.dtype(c.dtype) for c in connectors.values()]
