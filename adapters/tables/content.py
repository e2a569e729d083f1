"""What a table says: when, and which numbers; every problem at its place in the file."""

import csv
import importlib
import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from pathlib import Path
from typing import Any, Final

import numpy as np

from adapters.tables.heading import Heading
from orchestrator.errors import Location, Problem
from orchestrator.exact import exact
from orchestrator.signal import Array
from orchestrator.suggestion import suggestion
from orchestrator.table_files import NO_PARQUET, has_parquet
from orchestrator.timebase import NANOSECONDS_PER_SECOND
from orchestrator.units import Unit, parse_unit

MOST_PROBLEMS: Final = 100
"""More problems than these are counted, not told."""

_FIELD: Final = re.compile(r'(?:^|,)(\s*"(?:[^"]|"")*"\s*|[^,]*)')
_TIME_UNIT: Final = "s"
_LATEST: Final = (1 << 63) - 1
"""Nanoseconds that an integer of 64 bits holds."""


@dataclass(frozen=True, slots=True)
class Content:
    """A sound table.

    Attributes:
        times: strictly ascending [ns], int64, shape (row,).
        columns: by heading, in the order of the file; float64, shape (row,) each.
        lines: where each row is in the file, int64, shape (row,).
    """

    times: Array
    columns: dict[Heading, Array]
    lines: Array


@dataclass(frozen=True, slots=True)
class _Cell:
    """One field of the file: its text, or a number of Parquet, and where it is."""

    said: Any
    where: Location


@dataclass(slots=True)
class _Reading:
    """One reading of a file, collecting problems."""

    path: Path
    time: str
    problems: list[Problem] = field(default_factory=list)

    def content(self) -> Content | None:
        rows = self._parquet() if self.path.suffix == ".parquet" else self._csv()
        head = next(rows, None)
        if head is None:
            if not self.problems:
                self._add(Location(str(self.path), 1, 1), "the file is empty; write a heading")
            return None
        headings = self._headings(head)
        if self.problems:
            return None
        index = [heading.name for heading in headings].index(self.time)
        factor = _unit_of_time(headings[index]).factor * NANOSECONDS_PER_SECOND
        times: list[int] = []
        lines: list[int] = []
        values: list[list[float]] = [[] for _ in headings]
        line = head[0].where.line
        for row in rows:
            line = row[0].where.line
            if self._row(row, index, factor, times, values):
                lines.append(line)
        if not times and not self.problems:
            self._add(Location(str(self.path), line, 1), "there are no rows beneath the heading")
        if self.problems:
            return None
        columns = {
            heading: np.array(column)
            for k, (heading, column) in enumerate(zip(headings, values, strict=True))
            if k != index
        }
        return Content(np.array(times, np.int64), columns, np.array(lines, np.int64))

    def _add(self, where: Location, what: str) -> None:
        self.problems.append(Problem(where, what))

    def _headings(self, head: Sequence[_Cell]) -> list[Heading]:
        found: list[Heading] = []
        for cell in head:
            try:
                heading = Heading.parse(str(cell.said))
            except ValueError as error:
                self._add(cell.where, str(error))
                continue
            if heading.name in [each.name for each in found]:
                self._add(cell.where, f"there is a column `{heading.name}` already; rename one")
            found.append(heading)
        times = [h for h in found if h.name == self.time]
        if not times and not self.problems:
            hint = suggestion(self.time, [h.name for h in found])
            semicolons = "; columns are separated by `,`" if ";" in str(head[0].said) else ""
            what = f"there is no column `{self.time}` with the times; {hint}{semicolons}"
            self._add(head[0].where, what)
        if times and not _is_time(_unit_of_time(times[0])):
            what = f"`{self.time}` has the unit `{times[0].unit}`, which is no time; write `[s]`"
            self._add(head[[h.name for h in found].index(self.time)].where, what)
        return found

    def _row(
        self,
        row: Sequence[_Cell],
        index: int,
        factor: Fraction,
        times: list[int],
        values: list[list[float]],
    ) -> bool:
        """Take over one row, or say what is wrong with it; whether it is sound."""
        if len(row) != len(values):
            what = f"expected {len(values)} fields as in the heading, got {len(row)}"
            self._add(row[0].where, what)
            return False
        numbers = [self._number(cell) for cell in row]
        if any(number is None for number in numbers):
            return False
        exact = [number for number in numbers if number is not None]
        t = round(exact[index] * factor)
        if abs(t) > _LATEST:
            self._add(
                row[index].where, f"the time {row[index].said} does not fit into 64-bit nanoseconds"
            )
            return False
        if times and t <= times[-1]:
            what = f"the time {row[index].said} is not after the one in the row before"
            self._add(row[index].where, what)
            return False
        times.append(t)
        for column, number in zip(values, exact, strict=True):
            column.append(float(number))
        return True

    def _number(self, cell: _Cell) -> Fraction | None:
        """The exact number in a field."""
        said = cell.said
        text = said.strip().strip('"').strip() if isinstance(said, str) else said
        words = {"true": 1, "false": 0}
        if isinstance(text, str) and text.lower() in words:
            return Fraction(words[text.lower()])
        if text is None or text == "":
            self._add(cell.where, "there is no number")
            return None
        try:
            number = float(text)
            if math.isfinite(number):
                return exact(text) if isinstance(text, str) else Fraction(repr(number))
            self._add(cell.where, f"a number must be finite, got {text}")
        except (TypeError, ValueError):
            self._add(cell.where, f"expected a number, got `{text}`")
        return None

    def _csv(self) -> Iterator[list[_Cell]]:
        try:
            lines = self.path.read_bytes().decode("utf-8-sig").splitlines()
        except UnicodeDecodeError as error:
            before = error.object.count(b"\n", 0, error.start)
            what = f"byte 0x{error.object[error.start]:02x} is not UTF-8"
            self._add(Location(str(self.path), before + 1, 1), what)
            return
        except OSError as error:
            self._add(Location(str(self.path), 1, 1), f"cannot be read: {error.strerror}")
            return
        for number, line in enumerate(lines, 1):
            if not line.strip():
                continue
            if line.count('"') % 2:
                what = "a quote is not closed in this line"
                self._add(Location(str(self.path), number, line.index('"') + 1), what)
                continue
            columns = [match.start(1) + 1 for match in _FIELD.finditer(line)]
            try:
                fields = next(csv.reader([line]))
            except csv.Error as error:
                self._add(Location(str(self.path), number, 1), f"cannot be read: {error}")
                continue
            yield [
                _Cell(text, Location(str(self.path), number, column))
                for text, column in zip(fields, columns, strict=False)
            ]

    def _parquet(self) -> Iterator[list[_Cell]]:
        """The heading, then row by row; a row is as many lines down as in a CSV file."""
        top = Location(str(self.path), 1, 1)
        if not has_parquet():
            self._add(top, NO_PARQUET)
            return
        try:
            table = importlib.import_module("pyarrow.parquet").read_table(self.path)
            names = table.column_names
            columns = [table.column(k).to_pylist() for k in range(table.num_columns)]
        except Exception as error:  # whatever pyarrow thinks of the file
            self._add(top, f"cannot be read as Parquet: {error}")
            return
        yield [_Cell(name, Location(str(self.path), 1, k)) for k, name in enumerate(names, 1)]
        for line, row in enumerate(zip(*columns, strict=True), 2):
            yield [_Cell(v, Location(str(self.path), line, k)) for k, v in enumerate(row, 1)]


def read(path: Path, time: str) -> tuple[Content | None, tuple[Problem, ...]]:
    """The table in a file.

    Args:
        path: of a file, `.csv` or `.parquet`.
        time: name of the column with the times.

    Returns:
        The table, or `None` with what is wrong with it; of Parquet files with the row and the
        column in place of line and column.
    """
    reading = _Reading(path, time)
    content = reading.content()
    found = reading.problems[:MOST_PROBLEMS]
    if len(reading.problems) > MOST_PROBLEMS:
        last = found[-1].where
        found.append(Problem(last, f"and {len(reading.problems) - MOST_PROBLEMS} more like these"))
    return content, tuple(found)


def _unit_of_time(heading: Heading) -> Unit:
    """The unit of the times; seconds if none is said."""
    return parse_unit(_TIME_UNIT if heading.unit == "1" else heading.unit)


def _is_time(unit: Unit) -> bool:
    return unit.exponents == parse_unit(_TIME_UNIT).exponents and unit.reference is None
