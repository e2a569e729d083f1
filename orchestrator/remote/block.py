"""A block of signals as bytes: how it is laid out.

Layout of a block of signals; integers are unsigned and little-endian, every item is padded to
16 bytes so that decoded arrays are aligned:

    block: count u32 | 12 bytes zero | entry * count
    entry: index u16 | form u8 | rank u8 | 0 u32 | data length u64
           [16 bytes element type, NumPy's text, if form is FOREIGN]
           length of each axis u64 * rank | padding
           data | padding; if form is PLACED or PLACED_BINARY: place u64 | 8 bytes zero
A value that is at the other end already is named instead (`orchestrator.remote.naming`).
"""

import math
import re
import struct
from collections.abc import Iterator, Sequence
from typing import Any, Final, NamedTuple

import numpy as np
from typing_extensions import Buffer

from orchestrator.errors import CosimError
from orchestrator.signal import Array

COUNT: Final = struct.Struct("<I12x")
ENTRY: Final = struct.Struct("<HBBIQ")
TYPE: Final = struct.Struct("<16s")
PLACE: Final = struct.Struct("<Q8x")
_MAX_RANK: Final = 32
TIMES: Final = "mM"
"""Kinds of elements that the buffer protocol does not know."""
_PADDING: Final = tuple(bytes(-length % 16) for length in range(16))
_TRAVELLING: Final = re.compile(r"[<>|][biufcSUmM][1-9]\d{0,8}(\[\d*[A-Za-z]+\])?")
"""`dtype.str` of elements that are plain bytes and fully described by it."""


class WireError(CosimError):
    """Bytes are not a message, or a value cannot become one."""


# How an entry carries its value. Plain integers: an `Enum` costs more than the rest of an entry.
UNCHANGED: Final = 0  # not at all: it is the object that was sent last
DECLARED: Final = 1  # as an array of the element type that the connector declares
FOREIGN: Final = 2  # as an array of another element type; the receiver will want to complain
BINARY: Final = 3  # as bytes
PLACED: Final = 4  # as the place of an array of the declared element type in shared memory
PLACED_BINARY: Final = 5  # as the place of bytes in shared memory
NAMED: Final = 6  # by its name; who hands the message on fills the value in


def padding(length: int) -> bytes:
    """The zeros that follow `length` bytes."""
    return _PADDING[length % 16]


def element_type(text: str) -> "np.dtype[Any]":
    """The element type that NumPy calls `text`, whose elements are plain bytes.

    Raises:
        WireError: there is none, or its elements are objects, which are addresses in the memory
            of whoever has them: a peer that says which would read and run what it likes here.
    """
    try:
        if _TRAVELLING.fullmatch(text):
            dtype: np.dtype[Any] = np.dtype(text)
            return dtype
    except (TypeError, ValueError):
        pass
    raise WireError(f"{text!r} is not an element type")


class Entry(NamedTuple):
    """One entry of a block as it is written.

    Attributes:
        number: of the signal.
        form: how it carries its value.
        rank: of the array.
        length: of the data [byte].
        body: all that follows the head, padded.
    """

    number: int
    form: int
    rank: int
    length: int
    body: bytes

    @property
    def content(self) -> bytes:
        """The data of a value that is no array."""
        return self.body[: self.length]


def entries(message: bytes, offset: int) -> Iterator[Entry]:
    """The entries of the block from `offset` to the end of `message`, which go over a network.

    Raises:
        WireError: the bytes are no such block.
    """
    try:
        (count,) = COUNT.unpack_from(message, offset)
        offset += 16
        for _ in range(count):
            index, form, rank, _reserved, length = ENTRY.unpack_from(message, offset)
            offset += 16
            begin = offset
            if form in (DECLARED, FOREIGN):
                offset += (TYPE.size if form == FOREIGN else 0) + ((8 * rank + 15) & -16)
            elif form not in (UNCHANGED, BINARY, NAMED):
                raise WireError(f"signal {index} has the form {form}, which does not travel")
            offset = begin if form == UNCHANGED else end_of(message, offset, length)
            yield Entry(index, form, rank, length, message[begin:offset])
    except struct.error:
        raise WireError(f"a message of {len(message)} bytes ends too early") from None
    if offset != len(message):
        raise WireError(f"the signals end at byte {offset} of {len(message)}")


def replaced(message: bytes, offset: int, found: Sequence[Entry]) -> bytes:
    """The message with other entries in its block, which begins at `offset`."""
    parts = [message[:offset], COUNT.pack(len(found))]
    for each in found:
        parts += [ENTRY.pack(each.number, each.form, each.rank, 0, each.length), each.body]
    return b"".join(parts)


def _heads(with_type: str) -> tuple[struct.Struct, ...]:
    """Entry and lengths of the axes, for every rank."""
    return tuple(
        struct.Struct(f"<HBBIQ{with_type}{rank}Q{8 * (rank % 2)}x") for rank in range(_MAX_RANK + 1)
    )


DECLARED_HEADS: Final = _heads("")
_FOREIGN_HEADS: Final = _heads("16s")
_SHAPES: Final = tuple(struct.Struct(f"<{rank}Q") for rank in range(_MAX_RANK + 1))


def array_parts(
    index: int, name: str, value: Any, declared: "np.dtype[Any] | None"
) -> tuple[Buffer, ...]:
    """The entry of an array of any shape, as buffers.

    Args:
        index: of the signal.
        name: of the signal, for errors.
        value: an array.
        declared: the element type of the connector; `None`: it is declared binary.

    Raises:
        WireError: it is no array, or its elements cannot travel.
    """
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
        head = DECLARED_HEADS[rank].pack(index, DECLARED, rank, 0, length, *data.shape)
    else:
        text = dtype.str.encode()
        if not _TRAVELLING.fullmatch(dtype.str) or len(text) > TYPE.size:
            raise WireError(f"`{name}` has elements of type {dtype}, which cannot travel")
        head = _FOREIGN_HEADS[rank].pack(index, FOREIGN, rank, 0, length, text, *data.shape)
    if dtype.kind in TIMES:
        data = data.view(np.int64)
    return head, data.data, _PADDING[length % 16]


def read_dtype(message: bytes, offset: int) -> "np.dtype[Any]":
    """The element type that an entry of the form `FOREIGN` says; `WireError` if it is none."""
    (raw,) = TYPE.unpack_from(message, offset)
    return element_type(raw.rstrip(b"\0").decode("latin-1"))


def read_shape(
    message: bytes, offset: int, dtype: "np.dtype[Any]", rank: int, length: int
) -> tuple[tuple[int, ...], int]:
    """The shape of an array of `length` bytes, and the offset of what follows the shape.

    Raises:
        WireError: an array of that type has no such length in this shape, or no such rank.
    """
    if rank > _MAX_RANK:
        raise WireError(f"an array of rank {rank}")
    shape = _SHAPES[rank].unpack_from(message, offset)
    offset += (8 * rank + 15) & -16
    if math.prod(shape) * dtype.itemsize != length:
        raise WireError(f"{length} bytes cannot be an array of {dtype}{list(shape)}")
    return shape, offset


def read_array(
    message: bytes, offset: int, dtype: "np.dtype[Any]", rank: int, length: int
) -> tuple[Array, int]:
    """The array of any shape behind an entry, a read-only view, and the offset of what follows.

    Raises:
        WireError: there is none of that type and length.
    """
    shape, offset = read_shape(message, offset, dtype, rank, length)
    after = end_of(message, offset, length)
    try:
        if length == 0:
            empty = np.empty(shape, dtype)
            empty.flags.writeable = False
            return empty, after
        flat = np.frombuffer(message, dtype, length // dtype.itemsize, offset)
        return (flat if rank == 1 else flat.reshape(shape)), after
    except ValueError as error:
        raise WireError(f"an array of {dtype}{list(shape)}: {error}") from None


def end_of(message: bytes, offset: int, length: int) -> int:
    """The offset of what follows `length` bytes and their padding."""
    after = offset + ((length + 15) & -16)
    if after > len(message):
        raise WireError(f"a message of {len(message)} bytes ends too early")
    return after
