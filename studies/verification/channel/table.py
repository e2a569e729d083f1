"""CSV files, compressed or not, as one array per column."""

import csv
import gzip
import itertools
import zlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final, TextIO, cast

import numpy as np

from orchestrator.signal import Array
from studies.verification.channel.problems import GoldenError

_ROWS_AT_ONCE: Final = 50_000
"""Rows held as text at a time: the largest tables have a million."""

Column = Callable[[Sequence[str]], Array]
"""Turns the cells of a column into an array; raises `ValueError` for a wrong one."""


def text(cells: Sequence[str]) -> Array:
    """Non-empty strings."""
    if not all(cells):
        raise ValueError("must not be empty")
    return np.array(cells, object)


def number(cells: Sequence[str]) -> Array:
    """Finite numbers."""
    values = np.array(cells, np.str_).astype(float)
    if not np.isfinite(values).all():
        raise ValueError("must be finite")
    return values


def number_or_empty(cells: Sequence[str]) -> Array:
    """Finite numbers; NaN where there is nothing."""
    filled = number([cell or "0" for cell in cells])
    return np.where([not cell for cell in cells], np.nan, filled)


def whole(cells: Sequence[str]) -> Array:
    """Integers."""
    values = number(cells)
    if (values != np.round(values)).any():
        raise ValueError("must be a whole number")
    return values.astype(np.int64)


def nanoseconds(cells: Sequence[str]) -> Array:
    """Times in seconds, rounded to whole nanoseconds."""
    return np.round(number(cells) * 1e9).astype(np.int64)


@dataclass(frozen=True, slots=True)
class Table:
    """The rows of a CSV file under a header line.

    Attributes:
        name: of the file, for messages.
        columns: by the name in the header, shape (rows,).
    """

    name: str
    columns: Mapping[str, Array]

    def __getitem__(self, column: str) -> Array:
        """One column."""
        return self.columns[column]

    def __len__(self) -> int:
        """The number of rows."""
        return len(next(iter(self.columns.values())))

    def problem(self, row: int, what: str) -> GoldenError:
        """The error that says `what` is wrong with row `row`, counted from 0."""
        return GoldenError([f"{self.name}:{row + 2}: {what}"])

    def numbers_of(self, column: str, known: Mapping[str, int]) -> Array:
        """The numbers of the names in `column`, shape (rows,).

        Raises:
            GoldenError: a name is not `known`.
        """
        names = self.columns[column]
        try:
            return np.fromiter((known[name] for name in names), np.int64, len(names))
        except KeyError as error:
            row = list(names).index(error.args[0])
            raise self.problem(row, f"{column}: there is no `{error.args[0]}`") from error


def read_table(path: Path, name: str, columns: Mapping[str, Column]) -> Table:
    """The `columns` of the CSV file at `path`, called `name` in messages.

    Raises:
        GoldenError: it cannot be read, lacks a column, or a cell is wrong; the message names line
            and column.
    """
    parts: dict[str, list[Array]] = {column: [] for column in columns}
    try:
        with _opened(path) as file:
            rows = csv.reader(file)
            places = _places(next(rows, []), columns, name)
            first = 2  # the number of the line
            while chunk := list(itertools.islice(rows, _ROWS_AT_ONCE)):
                for column, cells in _cells(chunk, places, name, first):
                    parts[column].append(_converted(columns[column], cells, column, name, first))
                first += len(chunk)
    except (OSError, EOFError, zlib.error, UnicodeDecodeError, csv.Error) as error:
        raise GoldenError([f"{name}: cannot be read: {error}"]) from error
    if first == 2:
        raise GoldenError([f"{name}: has no rows"])
    return Table(name, {column: np.concatenate(found) for column, found in parts.items()})


def _opened(path: Path) -> TextIO:
    if path.suffix == ".gz":
        return cast("TextIO", gzip.open(path, "rt", encoding="utf-8", newline=""))
    return path.open(encoding="utf-8", newline="")


def _places(header: Sequence[str], columns: Mapping[str, Column], name: str) -> dict[str, int]:
    missing = [column for column in columns if column not in header]
    if missing:
        raise GoldenError([f"{name}:1: the column `{column}` is missing" for column in missing])
    return {column: header.index(column) for column in columns}


def _cells(
    rows: Sequence[Sequence[str]], places: Mapping[str, int], name: str, first: int
) -> Iterator[tuple[str, Sequence[str]]]:
    """The cells of each column."""
    width = max(places.values()) + 1
    for k, row in enumerate(rows):
        if len(row) < width:
            raise GoldenError([f"{name}:{first + k}: has {len(row)} cells; there must be {width}"])
    for column, place in places.items():
        yield column, [row[place] for row in rows]


def _converted(convert: Column, cells: Sequence[str], column: str, name: str, first: int) -> Array:
    try:
        return convert(cells)
    except ValueError:
        for k, cell in enumerate(cells):  # which one?
            try:
                convert([cell])
            except ValueError as error:
                what = f"`{cell}` is wrong: {error}"
                raise GoldenError([f"{name}:{first + k}: {column}: {what}"]) from error
        raise
