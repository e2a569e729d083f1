"""A block of rows as columns of numbers, and which filter each of them gets.

The recorder knows no unit, so it finds out for itself what helps: which `Form` samples of bytes
have follows from their lengths, and filters are tried on the first two blocks, and again when
blocks become larger.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from orchestrator.recording.filters import (
    Deltas,
    Filter,
    Guesses,
    Numbers,
    Planes,
    Records,
    Stream,
    Words,
    filter_of,
)
from orchestrator.zstd import Compressor

LEVEL: Final = 3
"""The level of Zstandard: the higher, the smaller and slower."""

MOST_COLUMNS: Final = 32
LONGEST_RECORD: Final = 256
"""Samples of bytes are cut into records of at most so many bytes."""

TRIED: Final = 1024
"""Numbers in the middle of a column on which simple filters are tried."""

SHORT: Final = 1 << 17
ENOUGH: Final = 64
"""A filter that makes numbers so many times smaller is taken without trying the others, where a
column has at most `SHORT` bytes: there is less to gain than a trial takes."""

FEWEST_GUESSED: Final = 1024
GUESSED: Final = 1 << 15
"""Guesses are looked for where a column has so many numbers; and among how many of them."""

NOISY: Final = 3.0
"""Guesses are looked for from so many compressed bytes per number on."""

WORTH: Final = 0.1
"""The share of numbers from which on a guess is used."""

_WORDS, _DELTAS, _PLANES = Words(), Deltas(), Planes()
_STAYING: Final[tuple[Filter, ...]] = (_WORDS, _DELTAS, _PLANES)
_GOING: Final[tuple[Filter, ...]] = (_DELTAS, _WORDS, _PLANES)
"""What is tried, in this order, on numbers that end as they begin, and on others."""
_NONE: Final = Records()
_COMPRESSOR: Final = Compressor(LEVEL, checksum=True)


@dataclass(frozen=True, slots=True, kw_only=True)
class Form:
    """How the bytes of a block are cut.

    Attributes:
        stride: bytes of a record, at least 1.
        word: bytes of a number: 1, 2, 4 or 8; divides `stride`.
        head: bytes ahead of the records of each sample.
    """

    stride: int
    word: int
    head: int = 0

    @classmethod
    def of_rows(cls, itemsize: int, row_bytes: int) -> "Form":
        """Rows of `row_bytes` bytes with elements of `itemsize` bytes."""
        word = _word(itemsize)
        many = row_bytes == 0 or row_bytes > word * MOST_COLUMNS
        return cls(stride=word if many else row_bytes, word=word)

    @classmethod
    def of_samples(cls, lengths: Sequence[int]) -> "Form":
        """Samples of `lengths` bytes: a head, the same for all, and any number of records.

        What divides the differences of the lengths is the length of a record, or a multiple.
        """
        some = np.array([n for n in lengths if n], np.int64)
        stride = int(np.gcd.reduce(np.diff(some))) if len(some) else 1
        stride = stride or int(some[0])  # all of one length
        if stride > LONGEST_RECORD:
            return cls(stride=1, word=1)
        return cls(
            stride=stride, word=_word(stride), head=int(some[0]) % stride if len(some) else 0
        )


def compress(stream: Stream) -> bytes:
    """A frame of Zstandard with checksum; the same bytes whenever the library is the same.

    Args:
        stream: what is compressed, any shape.
    """
    return _COMPRESSOR.frame(stream)


class Spare:
    """Memory that is used again, for new memory costs a page fault per 4 KiB."""

    __slots__ = ("_bytes",)

    def __init__(self) -> None:
        self._bytes = np.empty(0, np.uint8)

    def take(self, size: int) -> npt.NDArray[np.uint8]:
        """Return `size` bytes, shape (byte,), which belong to who takes them next."""
        if size > len(self._bytes):
            self._bytes = np.empty(size, np.uint8)
        return self._bytes[:size]


class Room:
    """Memory in which blocks are made, one after the other: that of all parts of a recording.

    Were it that of each part, a recording would take the more memory the more of its parts have
    filled a block.

    Attributes:
        rows: of a block.
        rest, turned: for `Columns.split`.
    """

    __slots__ = ("rest", "rows", "turned")

    def __init__(self) -> None:
        self.release()

    def release(self) -> None:
        """Give the memory back."""
        self.rows, self.rest, self.turned = Spare(), Spare(), Spare()


class Columns:
    """Makes streams of bytes of the blocks of one file, one after the other.

    What was found out about one block serves for the next ones.

    Args:
        form: of the rows; `None`: samples of bytes, whose lengths tell.
        room: in which they are made.
    """

    __slots__ = ("_cut", "_expected", "_filters", "_first", "_form", "_room", "_stale")

    WORSE: Final = 1.1
    """Filters are tried again when blocks have become so many times larger, compressed."""

    def __init__(self, form: Form | None, room: Room) -> None:
        self._form = form
        self._room = room
        self._cut: Form | None = None
        self._filters: tuple[Filter, ...] = ()
        self._first = self._stale = True
        self._expected = math.inf

    def split(
        self, content: bytes | memoryview, lengths: Sequence[int]
    ) -> tuple[dict[str, Any], list[Stream]]:
        """What a reader must know of a block, as JSON, and its streams.

        Args:
            content: the rows.
            lengths: bytes of each sample; not used for rows.

        Returns:
            What to know, and the streams: bytes, or arrays of any shape in C order. They last
            until the next block is split in the same room.
        """
        form = self._form or Form.of_samples(lengths)
        streams: list[Stream] = []
        if form.head:
            some = np.array([n for n in lengths if n], np.int64)
            ends = np.cumsum(some)
            starts = (ends - some).tolist()
            heads = b"".join([content[at : at + form.head] for at in starts])
            counts = (some - form.head) // form.stride
            streams = [counts.astype("<i8"), heads]
            rest = self._room.rest.take(len(content) - len(heads)).data
            to = 0
            for at, end in zip(starts, ends.tolist(), strict=True):
                begin, to = to, to + end - at - form.head
                rest[begin:to] = content[at + form.head : end]
            content = rest
        columns = self._columns(np.frombuffer(content, np.uint8), form)
        if form != self._cut or self._stale:
            self._cut, self._filters = form, _choose(columns)
            self._expected = math.inf
        earlier = Records()
        for each, column in zip(self._filters, columns, strict=True):
            streams += each.encode(column, earlier)
            earlier.append(column)
        about = {
            "stride": form.stride,
            "word": form.word,
            "head": form.head,
            "columns": [each.described() for each in self._filters],
        }
        return about, streams

    def learn(self, share: float) -> None:
        """Take note of what the last block has become.

        The first one says nothing: a run may begin unlike it goes on.

        Args:
            share: bytes compressed per byte.
        """
        self._stale = self._first or share > self.WORSE * self._expected
        self._first = False
        self._expected = min(self._expected, share)

    def memory(self) -> dict[str, Any]:
        """What was found out, as `orchestrator.packing` takes it."""
        return {
            "cut": None
            if self._cut is None
            else [self._cut.stride, self._cut.word, self._cut.head],
            "filters": [each.described() for each in self._filters],
            "expected": [self._first, self._stale, self._expected],
        }

    def recall(self, memory: Mapping[str, Any]) -> None:
        """Know what `memory` told."""
        if memory["cut"] is not None:
            stride, word, head = memory["cut"]
            self._cut = Form(stride=stride, word=word, head=head)
        self._filters = tuple(map(filter_of, memory["filters"]))
        self._first, self._stale, self._expected = memory["expected"]

    def _columns(self, data: "np.ndarray[Any, Any]", form: Form) -> list[Numbers]:
        """The numbers of `data`, shape (record,) each."""
        words = data.view(f"<u{form.word}").reshape(-1, form.stride // form.word).T
        if len(words) == 1:
            return [words[0]]
        columns = self._room.turned.take(len(data)).view(words.dtype).reshape(words.shape)
        columns[:] = words
        return list(columns)


def join(about: Mapping[str, Any], streams: Sequence[bytes]) -> "np.ndarray[Any, Any]":
    """The content of a block as bytes, uint8, shape (byte,); the reverse of `Columns.split`.

    Raises:
        KeyError, ValueError, IndexError: this cannot be what `Columns.split` made.
    """
    dtype = np.dtype(f"<u{about['word']}")
    rest = list(streams[2 if about["head"] else 0 :])
    columns = Records()
    for described in about["columns"]:
        each = filter_of(described)
        own, rest = rest[: each.streams], rest[each.streams :]
        columns.append(each.decode(own, dtype, columns))
    if len(columns) == 1:
        words = np.ascontiguousarray(columns[0])
    else:
        words = np.empty((len(columns[0]), len(columns)), dtype)
        for k in range(len(columns)):
            words[:, k] = columns[k]
    data = words.reshape(-1).view(np.uint8)
    head = about["head"]
    if not head:
        return data
    lengths = np.frombuffer(streams[0], "<i8") * about["stride"]
    if len(lengths) * head != len(streams[1]) or lengths.sum() != len(data):
        raise ValueError("heads and records do not fit together")
    ends = np.cumsum(lengths)
    samples = zip((ends - lengths).tolist(), ends.tolist(), strict=True)
    pieces: list[bytes | memoryview] = []
    for k, (at, end) in enumerate(samples):
        pieces += (streams[1][k * head : (k + 1) * head], data.data[at:end])
    return np.frombuffer(b"".join(pieces), np.uint8)


def _word(length: int) -> int:
    """The longest word that divides `length`."""
    return next(word for word in (8, 4, 2, 1) if length % word == 0)


def _choose(columns: Sequence[Numbers]) -> tuple[Filter, ...]:
    """The filter of each of `columns`."""
    chosen: list[Filter] = []
    noisy: list[int] = []
    for k, column in enumerate(columns):
        few = column[max(len(column) - TRIED, 0) // 2 :][:TRIED]
        size, best = _simple(few, ENOUGH if column.nbytes <= SHORT else math.inf)
        is_noisy = size > NOISY * len(few)
        if column.dtype.itemsize == 8 and len(column) >= FEWEST_GUESSED and is_noisy:
            some = Records([each[:GUESSED] for each in columns[:k]])
            best = _guesses(column[:GUESSED], some, noisy) or best
            noisy.append(k)
        chosen.append(best)
    return tuple(chosen)


def _simple(few: Numbers, enough: float) -> tuple[float, Filter]:
    """What the best simple filter makes of `few` numbers [byte], and that filter.

    Args:
        few: the numbers.
        enough: one that makes them so many times smaller is good enough.
    """
    stays = len(few) == 0 or few[0] == few[-1]
    tried = _STAYING if stays else _GOING
    sizes: dict[Filter, int] = {}
    for each in tried[:2] if few.dtype.itemsize == 1 else tried:  # planes of bytes are the bytes
        sizes[each] = len(compress(each.encode(few, _NONE)[0]))
        if sizes[each] * enough <= few.nbytes:
            break
    best = min(_STAYING, key=lambda each: sizes.get(each, math.inf))  # of equal ones, the cheapest
    return sizes[best], best


def _guesses(column: Numbers, earlier: Records, noisy: Sequence[int]) -> Guesses | None:
    """How to guess the numbers of `column`, if enough of them can be.

    Args:
        column: the numbers.
        earlier: the columns before.
        noisy: which of them are noisy doubles themselves.
    """
    most = [earlier[k].max() for k in range(len(earlier))]
    keys = [k for k, each in enumerate(most) if each < 1 << 16 and earlier[k][0] != each]
    pairs = [(i, j) for j in keys for i in keys if i <= j]
    if not pairs:
        return None
    share, pair = max((float(earlier.repeated(column, p).mean()), p) for p in pairs)
    value, count = np.unique(column, return_counts=True)
    common = int(value[count.argmax()])
    addend, constant, near = -1, 0.0, 0.0
    for k in noisy:
        guess = _constant(column, earlier[k])
        trial = Guesses(pair=pair, addend=k, constant=guess, common=common)
        hits = trial.near(column, earlier)
        if hits > max(near, WORTH):
            addend, constant, near = k, guess, hits
    if max(share, near, count.max() / len(column)) < WORTH:
        return None
    return Guesses(pair=pair, addend=addend, constant=constant, common=common)


def _constant(column: Numbers, addend: Numbers) -> float:
    """What is most often the difference of two columns of doubles; 0 if there is none."""
    with np.errstate(all="ignore"):
        difference = column.view("<f8") - addend.view("<f8")
        difference = difference[np.isfinite(difference)]
    if not len(difference):
        return 0.0
    bins, count = np.unique(np.round(difference, 9), return_counts=True)
    most = np.sort(difference[np.round(difference, 9) == bins[count.argmax()]])
    return float(most[len(most) // 2])
