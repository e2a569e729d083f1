"""Recorded signals as tidy tables: one row per time and element, one column per number.

Signals of one component along the same axes are columns of one table. Where an axis has numbers of
its own (a signal of that axis whose name is `id`), they name its elements; else their indices do.
"""

import itertools
import math
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Final, TypeAlias

import numpy as np

from orchestrator.installed import entry_points, loaded
from orchestrator.patterns import meant
from orchestrator.recording.declared import declared_shape, element_type, is_text, mime_type
from orchestrator.recording.layout import RecordingError
from orchestrator.recording.reader import Recording, Series
from orchestrator.signal import Array
from orchestrator.suggestion import suggestion
from orchestrator.table_files import Table
from orchestrator.timebase import seconds

MOST_COLUMNS: Final = 16
"""Elements along axes of constant length that are columns; of more, each has a row."""

ROWS: Final = 1 << 16
"""Rows that are in memory at once."""

TIME: Final = "time"
"""The column of times [s]: the double that is nearest, and `round(1e9 * time)` the time [ns]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TidyTable:
    """A table that is read as it is asked for.

    Attributes:
        name: of it, fit for a file.
        signals: what is in it, `component.connector`.
        keys: the columns that tell one row from another, the time first.
        units: of every column, by name and in their order.
        times: of the samples [ns], also of those without rows; int64, shape (sample,).
    """

    name: str
    signals: tuple[str, ...]
    keys: tuple[str, ...]
    units: Mapping[str, str]
    times: Array
    _read: Callable[["Lost"], Iterator[Table]]

    def blocks(self, lost: "Lost") -> Iterator[Table]:
        """The table in parts, one at least, possibly without rows.

        Args:
            lost: takes what cannot be read.
        """
        return self._read(lost)


@dataclass(slots=True)
class Lost:
    """What could not be read.

    Attributes:
        said: a sentence for each place.
        samples: how many samples were left out.
    """

    said: list[str]
    samples: int = 0

    @classmethod
    def nothing(cls) -> "Lost":
        """Nothing so far."""
        return cls([])

    def note(self, name: str, time: int, error: RecordingError) -> None:
        """Take note of a sample of the table `name`, at `time` [ns]."""
        self.samples += 1
        what = f"`{name}` is left out from {seconds(time):.9g} s on: {error}"
        if not any(said.endswith(f"s on: {error}") for said in self.said):
            self.said.append(what)


Decoder: TypeAlias = Callable[[Series], TidyTable]
"""Makes a table of a signal of bytes; the table has the name of the signal."""

GROUP: Final = "orchestrator.record_tables"
"""Entry points: mappings from MIME types, as connectors declare them, to a `Decoder` each."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Tables:
    """What a recording has in tables.

    Attributes:
        tables: by their names.
        left_out: why each of the other signals is in none, a sentence each.
    """

    tables: tuple[TidyTable, ...]
    left_out: tuple[str, ...]


def chosen(recording: Recording, patterns: Sequence[str]) -> tuple[str, ...]:
    """The recorded signals that `patterns` name, in their order; all of them if there are none.

    Args:
        recording: of a run.
        patterns: names, `component.connector`, in which `*` and `?` stand for any letters.

    Raises:
        RecordingError: there is no such signal.
    """
    if not patterns:
        return recording.signals
    wanted: set[str] = set()
    for pattern in patterns:
        found = meant(pattern, recording.signals)
        if not found:
            hint = suggestion(pattern, recording.signals)
            raise RecordingError(f"no signal `{pattern}` is recorded; {hint}")
        wanted.update(found)
    return tuple(name for name in recording.signals if name in wanted)


def tidy_tables(recording: Recording, signals: Collection[str]) -> Tables:
    """The tables of `signals`, as far as they can be opened.

    Signals of records are tables where an installed package says how (`GROUP`).

    Args:
        recording: of a run.
        signals: names of recorded signals.
    """
    decoders = _decoders()
    groups: dict[_Key, dict[str, Series]] = {}
    tables, left_out = [], []
    for name in signals:
        try:
            series = recording[name]
        except RecordingError as error:
            left_out.append(f"`{name}` is left out: {error}")
            continue
        mime = mime_type(series.kind)
        key = _key_of(name, series, is_fixed=recording.is_fixed(name))
        if key is not None:
            groups.setdefault(key, {})[name] = series
        elif mime is not None and mime in decoders:
            tables.append(decoders[mime](series))
        else:
            left_out.append(f"`{name}` is left out: {series.kind} has no columns")
    for key, found in groups.items():
        tables.append(_Group(recording, key, found).table())
    return Tables(tables=tuple(sorted(tables, key=lambda t: t.name)), left_out=tuple(left_out))


def _decoders() -> dict[str, Decoder]:
    found: dict[str, Decoder] = {}
    for entry in entry_points(group=GROUP):
        found.update(loaded(entry, f"the tables of records `{entry.name}` cannot be loaded"))
    return found


@dataclass(frozen=True, slots=True)
class _Key:
    """What signals of one table have in common.

    Attributes:
        component: that they are of.
        axes: whose elements have rows: names, or lengths.
        is_fixed: whether they have one sample only.
    """

    component: str
    axes: tuple[int | str, ...]
    is_fixed: bool

    @property
    def name(self) -> str:
        parts = (self.component, *map(str, self.axes), *(["fixed"] if self.is_fixed else []))
        return "-".join(parts)


def _key_of(name: str, series: Series, *, is_fixed: bool) -> _Key | None:
    component = name.partition(".")[0]
    shape = declared_shape(series.kind)
    if shape is None:
        return _Key(component, (), is_fixed) if is_text(series.kind) else None
    return _Key(component, tuple(shape[k] for k in _row_axes(shape)), is_fixed)


def _row_axes(shape: tuple[int | str, ...]) -> list[int]:
    """The axes whose elements have rows: those of names, and long ones."""
    lengths = [n for n in shape if isinstance(n, int)]
    is_long = math.prod(lengths) > MOST_COLUMNS
    return [k for k, n in enumerate(shape) if is_long or isinstance(n, str)]


class _Group:
    """Signals that are columns of one table."""

    def __init__(self, recording: Recording, key: _Key, series: Mapping[str, Series]) -> None:
        self._key = key
        self._ids = _ids_of(recording, key)
        self._flat = {name: Flat.of(each) for name, each in series.items()}
        self._shown = [name for name in series if self._ids is None or name != self._ids.name]
        self._keys = self._named_keys()

    def table(self) -> TidyTable:
        units = {TIME: "s", **dict.fromkeys(self._keys, "1")}
        for name in self._shown:
            units.update(dict.fromkeys(self._flat[name].columns, self._flat[name].series.unit))
        return TidyTable(
            name=self._key.name,
            signals=tuple(self._flat),
            keys=(TIME, *self._keys),
            units=units,
            times=self._times[: self._count],
            _read=self._blocks,
        )

    def _named_keys(self) -> list[str]:
        """What the columns of keys are called: an axis, or its index if it has no numbers."""
        axes = self._key.axes
        if self._ids is not None:
            return [str(axes[0])]
        names = [f"{axis}_index" if isinstance(axis, str) else "index" for axis in axes]
        return [f"{n}_{k}" if names.count(n) > 1 else n for k, n in enumerate(names)]

    def _blocks(self, lost: Lost) -> Iterator[Table]:
        count = self._count
        if count == 0:
            yield self._empty()
            return
        rows = np.max([each.lengths[:count] for each in self._all], axis=0)
        for first, end in spans(rows):
            yield self._read(first, end, lost)

    def _read(self, first: int, end: int, lost: Lost) -> Table:
        """Samples `first` to `end` - 1, less those that are lost."""
        try:
            return self._whole(first, end)
        except RecordingError as error:
            if end - first == 1:
                lost.note(self._key.name, int(self._times[first]), error)
                return self._empty()
        parts = [self._read(k, k + 1, lost) for k in range(first, end)]
        return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}

    @property
    def _all(self) -> list[Series]:
        found = [each.series for each in self._flat.values()]
        return found if self._ids is None else [*found, self._ids]

    @property
    def _count(self) -> int:
        """Samples that all of them have."""
        return min(len(each) for each in self._all)

    @property
    def _times(self) -> Array:
        return next(iter(self._flat.values())).series.times

    def _whole(self, first: int, end: int) -> Table:
        name, *others = self._flat
        shapes, _ = found = self._flat[name].read(first, end)
        rows = {name: found[1]}
        for other in others:
            its_shapes, rows[other] = self._flat[other].read(first, end)
            if not np.array_equal(its_shapes, shapes):
                raise RecordingError(f"`{other}` has not as many elements as `{name}`")
        counts = shapes.prod(axis=1)
        table = {TIME: np.repeat(self._times[first:end] / 1e9, counts)}
        if self._ids is not None:
            its_shapes, ids = Flat.of(self._ids).read(first, end)
            if not np.array_equal(its_shapes, shapes):
                raise RecordingError(f"`{self._ids.name}` has not as many elements as `{name}`")
            table[self._keys[0]] = ids[:, 0]
        else:
            table.update(zip(self._keys, _indices(shapes), strict=True))
        for shown in self._shown:
            columns = self._flat[shown].columns
            table.update(zip(columns, rows[shown].T, strict=True))
        return table

    def _empty(self) -> Table:
        table = {TIME: np.empty(0), **{key: np.empty(0, np.int64) for key in self._keys}}
        for shown in self._shown:
            flat = self._flat[shown]
            table.update({column: np.empty(0, flat.dtype) for column in flat.columns})
        return table


@dataclass(frozen=True, slots=True)
class Flat:
    """A signal as rows of numbers.

    Attributes:
        series: of the signal.
        shape: its declared one; `None` of text.
        columns: what its numbers in a row are called.
        dtype: of a number.
    """

    series: Series
    shape: tuple[int | str, ...] | None
    columns: tuple[str, ...]
    dtype: "np.dtype[np.generic]"

    @classmethod
    def of(cls, series: Series) -> "Flat":
        """A signal of numbers or of text."""
        shape = declared_shape(series.kind)
        name = series.name.partition(".")[2]
        if shape is None:
            return cls(series, None, (name,), np.dtype(object))
        rest = [n for k, n in enumerate(shape) if k not in _row_axes(shape) and isinstance(n, int)]
        places = itertools.product(*map(range, rest))
        columns = [f"{name}[{', '.join(map(str, place))}]" if place else name for place in places]
        return cls(series, shape, tuple(columns), np.dtype(element_type(series.kind)))

    @property
    def axes(self) -> list[int]:
        """The axes whose elements have rows."""
        return [] if self.shape is None else _row_axes(self.shape)

    def read(self, first: int, end: int) -> tuple[Array, Array]:
        """Samples `first` to `end` - 1.

        Returns:
            Lengths along the axes whose elements have rows, int64, shape (sample, axis); the
            numbers, shape (row, column).

        Raises:
            RecordingError: some of it is lost.
        """
        width, axes = len(self.columns), self.axes
        if self.shape is None:
            texts = [bytes(self.series[k]).decode(errors="replace") for k in range(first, end)]
            return np.zeros((end - first, 0), np.int64), np.array(texts, object).reshape(-1, 1)
        if not axes:
            rows = self.series.between(first, end).reshape(end - first, width)
            return np.zeros((end - first, 0), np.int64), rows
        if axes == [0]:
            long = self.shape[0]  # a name, or the length of a constant axis with many elements
            lengths = self.series.lengths[first:end]
            lengths = np.full_like(lengths, long) if isinstance(long, int) else lengths
            rows = self.series.between(first, end)
            return lengths[:, None], rows.reshape(int(lengths.sum()), width)
        samples = [np.asarray(self.series[k]) for k in range(first, end)]
        parts = [np.moveaxis(each, axes, range(len(axes))).reshape(-1, width) for each in samples]
        shapes = [[each.shape[axis] for axis in axes] for each in samples]
        return np.array(shapes, np.int64).reshape(-1, len(axes)), np.concatenate(parts)


def spans(rows: Array) -> Iterator[tuple[int, int]]:
    """Samples that are read together, as the first and the one after the last.

    Args:
        rows: of each sample, int64, shape (sample,).
    """
    ends = np.cumsum(np.maximum(rows, 1))
    first = 0
    while first < len(ends):
        before = int(ends[first - 1]) if first else 0
        end = max(int(np.searchsorted(ends, before + ROWS, side="right")), first + 1)
        yield first, end
        first = end


def _indices(shapes: Array) -> list[Array]:
    """The index of every row along each axis, int64, shape (row,) each; shapes (sample, axis)."""
    if shapes.shape[1] == 0:
        return []
    if shapes.shape[1] == 1:
        counts = shapes[:, 0]
        starts = np.repeat(np.cumsum(counts) - counts, counts)
        return [np.arange(len(starts)) - starts]
    found = [np.indices(tuple(shape)).reshape(len(shape), -1) for shape in shapes.tolist()]
    empty = np.empty((shapes.shape[1], 0), np.int64)
    return list(np.concatenate([empty, *found], axis=1))


def _ids_of(recording: Recording, key: _Key) -> Series | None:
    """The numbers of the elements of an axis: the signal `id` along it, if there is one."""
    if len(key.axes) != 1 or isinstance(key.axes[0], int):
        return None
    found = [
        name
        for name in recording.signals
        if name.partition(".")[0] == key.component
        and name.rpartition(".")[2] == "id"
        and recording.kind(name) == f"int64[{key.axes[0]}]"
        and recording.is_fixed(name) == key.is_fixed
    ]
    try:
        return recording[found[0]] if len(found) == 1 else None
    except RecordingError:
        return None
