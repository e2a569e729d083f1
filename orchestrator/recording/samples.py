"""The samples of one signal on disk: how each `Layout` is written and read."""

import abc
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from typing_extensions import override

from orchestrator.recording.layout import Files, Layout, RecordingError
from orchestrator.recording.parts import Latest, Part, Shared
from orchestrator.recording.stored import Stored
from orchestrator.signal import Array, Connector, Signal
from orchestrator.stretch import Rows

INT64: Final = np.dtype("<i8")
"""The type of times, row counts and shapes."""

UINT8: Final = np.dtype(np.uint8)


class SampleWriter(abc.ABC):
    """Writes the samples of one signal.

    Attributes:
        parts: its files, in the order in which they are to be flushed: values first, so that
            row counts and shapes never promise values that are not there.
    """

    __slots__ = ("parts",)

    parts: tuple[Part, ...]

    @abc.abstractmethod
    def write(self, value: Any) -> None:
        """Append one sample, which fits the connector."""

    @abc.abstractmethod
    def write_rows(self, rows: Rows, count: int, *, are_kept: bool) -> None:
        """Append `count` samples of one size, or of type Binary.

        Args:
            rows: the samples.
            count: how many.
            are_kept: whether rows of arrays never change.
        """


class _UniformWriter(SampleWriter):
    __slots__ = ("_append", "_append_rows")

    def __init__(self, files: Files, connector: Connector, shared: Shared) -> None:
        shape = tuple(n for n in connector.shape if isinstance(n, int))
        dtype = np.dtype(connector.dtype)
        values = _part(files, files.values, dtype, shape, shared, kind=connector.kind())
        self.parts = (values,)
        self._append = values.append
        self._append_rows = values.append_rows

    @override
    def write(self, value: Array) -> None:
        self._append(value.tobytes())

    @override
    def write_rows(self, rows: Rows, count: int, *, are_kept: bool) -> None:
        self._append_rows(rows.data, count, is_kept=are_kept)


class _RowsWriter(SampleWriter):
    """Samples of any number of rows; both are counted."""

    __slots__ = ("_append", "_append_rows")

    def __init__(self, files: Files, values: Part, shared: Shared) -> None:
        rows = _part(files, files.rows, INT64, (), shared)
        self.parts = (values, rows)
        self._append = values.append
        self._append_rows = rows.append

    def _write(self, data: bytes, rows: int) -> None:
        self._append(data, rows)
        self._append_rows(rows.to_bytes(8, "little"))


class _RaggedWriter(_RowsWriter):
    __slots__ = ()

    def __init__(self, files: Files, connector: Connector, shared: Shared) -> None:
        shape = tuple(n for n in connector.shape if isinstance(n, int))
        dtype = np.dtype(connector.dtype)
        values = _part(files, files.values, dtype, shape, shared, kind=connector.kind())
        super().__init__(files, values, shared)

    @override
    def write(self, value: Array) -> None:
        self._write(value.tobytes(), len(value))

    @override
    def write_rows(self, rows: Rows, count: int, *, are_kept: bool) -> None:
        values, lengths = self.parts
        _append_equal(values, rows, count, rows.shape[0])
        lengths.append_rows(np.full(count, rows.shape[0], INT64).tobytes(), count)


class _FlatWriter(SampleWriter):
    __slots__ = ("_append", "_append_shape")

    def __init__(self, files: Files, connector: Connector, shared: Shared) -> None:
        dtype = np.dtype(connector.dtype)
        values = _part(files, files.values, dtype, (), shared, kind=connector.kind())
        shapes = _part(files, files.shapes, INT64, (len(connector.shape),), shared)
        self.parts = (values, shapes)
        self._append = values.append
        self._append_shape = shapes.append

    @override
    def write(self, value: Array) -> None:
        self._append(value.tobytes(), value.size)
        self._append_shape(np.array(value.shape, INT64).tobytes())

    @override
    def write_rows(self, rows: Rows, count: int, *, are_kept: bool) -> None:
        values, shapes = self.parts
        _append_equal(values, rows, count, math.prod(rows.shape))
        shapes.append_rows(np.tile(np.array(rows.shape, INT64), count).tobytes(), count)


class _BinaryWriter(_RowsWriter):
    __slots__ = ()

    def __init__(self, files: Files, connector: Connector, shared: Shared) -> None:
        values = _part(files, files.values, UINT8, (), shared, kind=connector.kind(), samples=True)
        super().__init__(files, values, shared)

    @override
    def write(self, value: bytes) -> None:
        self._write(value, len(value))

    @override
    def write_rows(self, rows: Rows, count: int, *, are_kept: bool) -> None:
        values, sizes = self.parts
        values.append_samples(rows.data, rows.sizes)
        sizes.append_rows(rows.sizes.tobytes(), count)


def _append_equal(values: Part, rows: Rows, count: int, each: int) -> None:
    """Append `count` samples of `each` rows."""
    if rows.data:
        values.append_samples(rows.data, np.full(count, len(rows.data) // count))
        return
    for _ in range(count):
        values.append(b"", each)


def times_part(files: Files, shared: Shared | None = None) -> Part:
    """Create the part with the times of a component, or go on with what is there."""
    shared = shared or Shared()
    return _part(files, files.times, INT64, (), shared, latest=shared.times)


def _part(
    files: Files,
    path: Path,
    dtype: "np.dtype[Any]",
    row_shape: tuple[int, ...],
    shared: Shared | None,
    *,
    kind: str = "",
    samples: bool = False,
    latest: Latest | None = None,
) -> Part:
    name = files.name_of(path)
    return Part(
        path, name, dtype, row_shape, kind=kind, samples=samples, latest=latest, shared=shared
    )


def sample_writer(files: Files, connector: Connector, shared: Shared) -> SampleWriter:
    """Create the writer of the samples of one signal, and its files if none are there again."""
    match Layout.of(connector):
        case Layout.UNIFORM:
            return _UniformWriter(files, connector, shared)
        case Layout.RAGGED:
            return _RaggedWriter(files, connector, shared)
        case Layout.FLAT:
            return _FlatWriter(files, connector, shared)
        case Layout.BINARY:
            return _BinaryWriter(files, connector, shared)


@dataclass(frozen=True, slots=True)
class Samples:
    """The samples of one signal, read when they are asked for.

    Attributes:
        values: the part with the values.
        ends: sample `k` lies in `values[ends[k] : ends[k + 1]]`.
        decode: makes the sample `k` of that.
    """

    values: Stored
    ends: Sequence[int] | Array
    decode: Callable[[int, Array], Signal]

    def __len__(self) -> int:
        return len(self.ends) - 1

    def __getitem__(self, k: int) -> Signal:
        return self.decode(k, self.values[int(self.ends[k]) : int(self.ends[k + 1])])


def read_samples(files: Files, layout: Layout) -> Samples:
    """Open the samples of one signal.

    Raises:
        RecordingError: a part is missing, or what says where samples begin is damaged.
    """
    values = Stored.open(files.values)
    match layout:
        case Layout.UNIFORM:
            return Samples(
                values, range(len(values) + 1), lambda _, rows: rows.reshape(rows.shape[1:])
            )
        case Layout.RAGGED:
            return Samples(values, _ends(load(files.rows), values), lambda _, rows: rows)
        case Layout.FLAT:
            shapes = load(files.shapes, rank=1)
            ends = _ends(shapes.prod(axis=1), values)
            return Samples(values, ends, lambda k, rows: rows.reshape(shapes[k]))
        case Layout.BINARY:
            return Samples(values, _ends(load(files.rows), values), lambda _, rows: rows.tobytes())


def parts(files: Files, layout: Layout) -> tuple[Path, ...]:
    """The files of one signal, values first."""
    match layout:
        case Layout.UNIFORM:
            return (files.values,)
        case Layout.RAGGED | Layout.BINARY:
            return (files.values, files.rows)
        case Layout.FLAT:
            return (files.values, files.shapes)


def load(path: Path, rank: int = 0) -> Array:
    """All rows of the part in `path`, whole numbers, read-only, shape (row, ...).

    Args:
        path: of the part.
        rank: how many axes a row has.

    Raises:
        RecordingError: it is missing or damaged, or holds something else.
    """
    stored = Stored.open(path)
    if stored.dtype.kind != "i" or len(stored.row_shape) != rank:
        raise other(path, stored)
    return stored[0 : len(stored)]


def other(path: Path, stored: Stored) -> RecordingError:
    """What to raise of a sound part that is not the one that should be there."""
    found = f"{stored.dtype}{list(stored.row_shape)}"
    return RecordingError(
        f"`{path}` is damaged: it holds rows of {found}, which are another file's"
    )


def _ends(lengths: Array, values: Stored) -> Array:
    """Where each sample begins, and where the last one ends, as far as there are values."""
    ends = np.concatenate(([0], np.cumsum(lengths, dtype=np.int64)))
    return ends[: np.searchsorted(ends, len(values), side="right")]
