"""Results read back: from CSV and Parquet files, and from run directories."""

import csv
import re
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, Final

import numpy as np

from adapters.fmi.command.table import TIME, Results, TableError
from orchestrator.recording import Recording
from orchestrator.signal import Array
from orchestrator.table_files import read_table
from orchestrator.units import NoUnitError, Unit, UnitError, number_in, parse_unit

_HEADING: Final = re.compile(r"(?P<name>.*\S)\s+\[(?P<unit>[^\[\]]*)\]")
_SECOND: Final = parse_unit("s")
_EXACT: Final = 15
"""Digits of a whole number that float64 has in any case."""


def read_results(path: Path, *, skip_text: bool = False) -> Results:
    """The results in a CSV or Parquet file, or in a run directory.

    Headings may have units, `speed [km/h]`; a time without one is in seconds.

    Args:
        path: of the file or the directory.
        skip_text: whether columns without any number are left out; else they are problems.

    Raises:
        TableError: every problem, each with its line.
        RecordingError: the run directory has no recording.
        MissingParquetError: pyarrow is not installed.
    """
    if path.is_dir():
        return _recorded(path)
    try:
        is_parquet = path.suffix == ".parquet"
        table = _read_parquet(path) if is_parquet else _read_csv(path, skip_text=skip_text)
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or "is no text in UTF-8"
        raise TableError(f"{path}: cannot be read: {reason}") from error
    columns, units = _without_units(table)
    times = columns.pop(TIME, None)
    if times is None:
        raise TableError(f"{path}:1: there is no column `{TIME}` [s]")
    times = np.asarray(times, np.float64) * _seconds(path, units.pop(TIME, "s"))
    wrong = np.flatnonzero(~(np.diff(times) >= 0))
    if len(wrong):
        k = int(wrong[0]) + 1
        what = f"the time {times[k]:g} s comes after {times[k - 1]:g} s"
        raise TableError(f"{path}:{k + 2}: {what}; times have to ascend")
    return Results(times, columns, units)


def converted(
    values: Array,
    source: str,
    target: str,
    definition: Unit | None = None,
    *,
    is_difference: bool = False,
) -> Array:
    """Values in another unit.

    Args:
        values: of any shape.
        source: their unit.
        target: the other one.
        definition: what the other one is; `None`: what the table of units says.
        is_difference: whether the offsets of units do not count.

    Raises:
        UnitError: a unit does not exist, or they measure different quantities.
    """
    try:
        zero, one = (
            float(number_in(f"{n} {source}", target, definition, is_difference=is_difference))
            for n in (0, 1)
        )
    except NoUnitError:
        raise UnitError(f"expected a quantity in {target}, got a pure number") from None
    return values * (one - zero) + zero


def _without_units(table: Mapping[str, Array]) -> tuple[dict[str, Array], dict[str, str]]:
    """Columns by name, and the units that the headings say."""
    columns, units = {}, {}
    for heading, column in table.items():
        match = _HEADING.fullmatch(heading)
        name = match["name"] if match else heading
        columns[name] = column
        if match:
            units[name] = match["unit"]
    return columns, units


def _seconds(path: Path, unit: str) -> float:
    """How many seconds a unit of time has."""
    try:
        found = parse_unit(unit)
    except UnitError as error:
        raise TableError(f"{path}:1: `{TIME}`: {error}") from error
    if found.exponents != _SECOND.exponents:
        raise TableError(f"{path}:1: `{TIME}` is in `{unit}`, which is no time")
    return float(found.factor)


def _read_parquet(path: Path) -> dict[str, Array]:
    """The columns of numbers."""
    return {n: c for n, c in read_table(path).items() if np.asarray(c).dtype.kind in "biuf"}


def _read_csv(path: Path, *, skip_text: bool) -> dict[str, Array]:
    problems: list[str] = []
    wrong: dict[str, list[str]] = {}
    with path.open(encoding="utf-8-sig", newline="") as file:
        reader = csv.reader(file)
        header = [name.strip() for name in next(reader, [])]
        if twice := sorted({name for name in header if header.count(name) > 1}):
            problems.append(f"{path}:1: the column `{twice[0]}` is there twice")
        values: list[list[list[float | int]]] = [[] for _ in header]
        for row in reader:
            if not row:
                continue
            line = reader.line_num
            if len(row) != len(header):
                problems.append(f"{path}:{line}: {len(row)} fields, the header has {len(header)}")
                continue
            for name, column, text in zip(header, values, row, strict=True):
                try:
                    found = _numbers(text)
                except ValueError:
                    what = f"{path}:{line}: `{name}`: `{text}` is no number"
                    wrong.setdefault(name, []).append(what)
                    continue
                column.append(found)
                if len(found) != len(column[0]):
                    sizes = f"{len(column[0])} and {len(found)}"
                    problems.append(f"{path}:{line}: `{name}` has rows of {sizes}")
    texts = {n for n, v in zip(header, values, strict=True) if n in wrong and not v and skip_text}
    problems += [what for name, found in wrong.items() if name not in texts for what in found]
    if problems:
        raise TableError("\n".join(problems))
    return {n: _column(v) for n, v in zip(header, values, strict=True) if n not in texts}


def _numbers(text: str) -> list[float | int]:
    """The numbers in a field; an empty one is NaN, as in tables that are written."""
    return [_number(word) for word in text.lower().split() or ["nan"]]


def _number(word: str) -> float | int:
    """A number; an `int` if it is a whole one that float64 may not have."""
    if len(word) > _EXACT and word.lstrip("+-").isdecimal():
        return int(word)
    return {"true": 1.0, "false": 0.0}[word] if word in {"true", "false"} else float(word)


def _column(rows: list[list[float | int]]) -> Array:
    """Numbers as float64; as 64-bit integers where all are whole and float64 may not have one."""
    values: Array = np.array(rows, np.float64)
    if any(isinstance(n, int) for row in rows for n in row) and (values == np.floor(values)).all():
        whole = [[int(n) for n in row] for row in rows]
        low, high = (of(n for row in whole for n in row) for of in (min, max))
        for info in map(np.iinfo, (np.uint64, np.int64)):
            if info.min <= low and high <= info.max:
                values = np.array(whole, info.dtype)
    return values[:, 0] if values.ndim == 2 and values.shape[1] == 1 else values


def _recorded(path: Path) -> Results:
    """The numbers of a run at all times at which one was published; others hold until then."""
    recording = Recording(path)
    series = [each for each in map(recording.__getitem__, recording.signals) if _is_plain(each)]
    if not series:
        raise TableError(f"{path}: there is no recorded signal of numbers")
    times = _union(each.times for each in series)
    columns = {}
    for each in series:
        places = np.searchsorted(each.times, times, side="right") - 1
        columns[each.name] = np.asarray(each.values)[np.maximum(places, 0)]
    return Results(times / 1e9, columns, {each.name: each.unit for each in series})


def _union(all_times: Iterable[Array]) -> Array:
    """All times of all series [ns], ascending."""
    union = np.empty(0, np.int64)
    for times in all_times:
        if not np.array_equal(union, times):
            union = np.union1d(union, times)
    return union


def _is_plain(series: Any) -> bool:
    """Whether samples are numbers of one shape, and there are some."""
    if "binary" in series.kind:
        return False
    values = np.asarray(series.values)
    return len(series) > 0 and values.dtype.kind in "biuf" and len(values) == len(series)
