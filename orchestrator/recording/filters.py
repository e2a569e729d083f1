"""Filters: what is done to a column of numbers so that it compresses better. Nothing is lost.

A column is an array of unsigned integers of 1, 2, 4 or 8 bytes: the bits of what was recorded.
"""

import abc
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final, TypeAlias

import numpy as np
import numpy.typing as npt
from typing_extensions import override

from orchestrator.recording.planes import planes

Numbers: TypeAlias = npt.NDArray[np.unsignedinteger[Any]]
Int: TypeAlias = npt.NDArray[np.int64]
Stream: TypeAlias = bytes | npt.NDArray[Any]
"""Bytes, or an array in C order, whose bytes are meant."""

VERBATIM: Final = 0
AS_BEFORE: Final = 1
NEAR: Final = 2
COMMON: Final = 3
"""How a value is told by `Guesses`."""

_NEAR: Final = np.dtype("<i2")
_SHIFT: Final = np.uint64((1 << 15) - 1)
_RANGE: Final = np.uint64((1 << 16) - 1)


class Records:
    """The columns of a block that are known so far.

    Args:
        columns: of the same length.
    """

    __slots__ = ("_columns", "_orders")

    def __init__(self, columns: Sequence[Numbers] = ()) -> None:
        self._columns = list(columns)
        self._orders: dict[tuple[int, int], tuple[Int, npt.NDArray[np.bool_]]] = {}

    def __len__(self) -> int:
        return len(self._columns)

    def __getitem__(self, k: int) -> Numbers:
        return self._columns[k]

    def append(self, column: Numbers) -> None:
        """Add the next column, shape (record,)."""
        self._columns.append(column)

    def linked(self, pair: tuple[int, int]) -> tuple[Int, npt.NDArray[np.bool_]]:
        """The records sorted by their two numbers in the columns `pair`, in either order.

        Of 16 bits of them, to be exact: others may come between, and guesses go wrong more often.

        Returns:
            Indices of the records, shape (record,), and whether one has the numbers of the one
            before it there, shape (record,).
        """
        if pair not in self._orders:
            one, other = self._columns[pair[0]], self._columns[pair[1]]
            low, high = np.minimum(one, other), np.maximum(one, other)
            key = (low * low.dtype.type(331) + high).astype(np.uint16)
            order = np.argsort(key, kind="stable")
            key = key[order]
            same = np.zeros(len(key), np.bool_)
            same[1:] = key[1:] == key[:-1]
            self._orders[pair] = order, same
        return self._orders[pair]

    def repeated(self, column: Numbers, pair: tuple[int, int]) -> npt.NDArray[np.bool_]:
        """Where a value of `column` is that of the record before in `linked`, shape (record,)."""
        order, same = self.linked(pair)
        value = column[order]
        result = np.empty_like(same)
        same = same.copy()
        same[1:] &= value[1:] == value[:-1]
        result[order] = same
        return result


class Filter(abc.ABC):
    """Makes streams of bytes of a column, and the column of them again."""

    __slots__ = ()

    @property
    def streams(self) -> int:
        """How many streams of bytes it makes of a column."""
        return 1

    @abc.abstractmethod
    def encode(self, column: Numbers, earlier: "Records") -> tuple[Stream, ...]:
        """The streams of `column`: bytes, or arrays of any shape in C order.

        Args:
            column: the numbers, shape (record,).
            earlier: the columns that a reader will have by then.
        """

    @abc.abstractmethod
    def decode(
        self, streams: Sequence[bytes], dtype: "np.dtype[Any]", earlier: "Records"
    ) -> Numbers:
        """The column, of type `dtype`, shape (record,); the reverse of `encode`."""

    @abc.abstractmethod
    def described(self) -> Mapping[str, Any]:
        """What a reader must know, as JSON."""


class Words(Filter):
    """The numbers one after the other."""

    __slots__ = ()

    @override
    def encode(self, column: Numbers, earlier: "Records") -> tuple[Stream, ...]:
        return (column,)

    @override
    def decode(
        self, streams: Sequence[bytes], dtype: "np.dtype[Any]", earlier: "Records"
    ) -> Numbers:
        return np.frombuffer(streams[0], dtype)

    @override
    def described(self) -> Mapping[str, Any]:
        return {"filter": "words"}


class Planes(Filter):
    """The lowest byte of all numbers, then the next one of all, ..."""

    __slots__ = ()

    @override
    def encode(self, column: Numbers, earlier: "Records") -> tuple[Stream, ...]:
        return (planes(column),)

    @override
    def decode(
        self, streams: Sequence[bytes], dtype: "np.dtype[Any]", earlier: "Records"
    ) -> Numbers:
        return _joined(streams[0], dtype)

    @override
    def described(self) -> Mapping[str, Any]:
        return {"filter": "planes"}


class Deltas(Filter):
    """The planes of the differences to the number before, without carry; the first one to 0."""

    __slots__ = ()

    @override
    def encode(self, column: Numbers, earlier: "Records") -> tuple[Stream, ...]:
        return (planes(column, are_deltas=True),)

    @override
    def decode(
        self, streams: Sequence[bytes], dtype: "np.dtype[Any]", earlier: "Records"
    ) -> Numbers:
        return np.cumsum(_joined(streams[0], dtype), dtype=dtype)

    @override
    def described(self) -> Mapping[str, Any]:
        return {"filter": "deltas"}


@dataclass(frozen=True, slots=True, kw_only=True)
class Guesses(Filter):
    """Doubles that can often be guessed from other columns of the same record.

    Of each value a byte says how it is told: `AS_BEFORE`, it is that of the record before that
    has the same two numbers in the columns `pair`, in either order, as a radio link has the same
    loss there and back; `NEAR`, its bits, read as an integer, differ by less than 2^15 from those
    of the sum of a column and a constant; `COMMON`, it is one certain value, e.g. NaN;
    `VERBATIM`, none of it.

    Attributes:
        pair: the indices of two earlier columns; the same one twice: that column.
        addend: the index of an earlier column of doubles, or -1: no value is `NEAR`.
        constant: what is added to it.
        common: the bits of the common value.
    """

    pair: tuple[int, int]
    addend: int
    constant: float
    common: int

    @property
    @override
    def streams(self) -> int:
        return 3

    @override
    def encode(self, column: Numbers, earlier: "Records") -> tuple[Stream, ...]:
        how = np.full(len(column), VERBATIM, np.uint8)
        off = self._residual(column, earlier)
        how[_is_near(off)] = NEAR
        how[earlier.repeated(column, self.pair)] = AS_BEFORE
        how[column == column.dtype.type(self.common)] = COMMON
        near = off[how == NEAR].astype(_NEAR)
        return how, planes(near), planes(column[how == VERBATIM])

    @override
    def decode(
        self, streams: Sequence[bytes], dtype: "np.dtype[Any]", earlier: "Records"
    ) -> Numbers:
        how = np.frombuffer(streams[0], np.uint8)
        column = np.full(len(how), self.common, dtype)
        near = how == NEAR
        column[near] = self._sum(earlier)[near] + _joined(streams[1], _NEAR).astype(np.int64).view(
            dtype
        )
        column[how == VERBATIM] = _joined(streams[2], dtype)
        order, _ = earlier.linked(self.pair)
        here = np.where(how[order] == AS_BEFORE, 0, np.arange(len(order)))
        result = np.empty_like(column)
        result[order] = column[order][np.maximum.accumulate(here)]
        return result

    @override
    def described(self) -> Mapping[str, Any]:
        return {
            "filter": "guesses",
            "pair": list(self.pair),
            "addend": self.addend,
            "constant": self.constant,
            "common": self.common,
        }

    def near(self, column: Numbers, earlier: "Records") -> float:
        """The share of the values of `column`, shape (record,), that are near the sum."""
        return float(_is_near(self._residual(column, earlier)).mean())

    def _residual(self, column: Numbers, earlier: "Records") -> Int:
        """The bits of the values less those of the sum; where there is no sum, far off."""
        if self.addend < 0:
            return np.full(len(column), 1 << 15, np.int64)
        total = self._sum(earlier)
        off = (column - total).view(np.int64)
        # a NaN of a sum has other bits on another processor
        off[~np.isfinite(total.view("<f8"))] = 1 << 15
        return off

    def _sum(self, earlier: "Records") -> Numbers:
        if self.addend < 0:
            return np.zeros_like(earlier[self.pair[0]])
        with np.errstate(all="ignore"):
            total: Numbers = (earlier[self.addend].view("<f8") + self.constant).view("<u8")
        return total


def filter_of(described: Mapping[str, Any]) -> Filter:
    """The filter that `Filter.described` described.

    Raises:
        KeyError: there is none of that name.
    """
    plain: dict[str, Filter] = {"words": Words(), "planes": Planes(), "deltas": Deltas()}
    if described["filter"] != "guesses":
        return plain[described["filter"]]
    one, other = described["pair"]
    return Guesses(
        pair=(int(one), int(other)),
        addend=int(described["addend"]),
        constant=float(described["constant"]),
        common=int(described["common"]),
    )


def _is_near(off: Int) -> npt.NDArray[np.bool_]:
    # -2^15 + 1 becomes 0 and 2^15 - 1 becomes 2^16 - 2; what is less wraps around
    result: npt.NDArray[np.bool_] = (off.view(np.uint64) + _SHIFT) < _RANGE
    return result


def _joined(stream: bytes, dtype: "np.dtype[Any]") -> npt.NDArray[Any]:
    shape = (dtype.itemsize, -1) if stream else (dtype.itemsize, 0)
    rows = np.ascontiguousarray(np.frombuffer(stream, np.uint8).reshape(shape).T)
    return rows.reshape(-1).view(dtype)
