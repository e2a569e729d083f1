"""Golden files as they are read: JSON and CSV whose values know their place, for errors."""

import csv
import gzip
import itertools
import json
import math
import zlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, TextIO, cast

import numpy as np

from orchestrator.errors import CosimError
from orchestrator.signal import Array

_ROWS_AT_ONCE: Final = 50_000
"""Rows held as text at a time: the largest tables have a million."""


class GoldenError(CosimError):
    """Golden data cannot be used. Who made them can fix it. Exit code 2.

    Attributes:
        problems: one sentence each, `FILE: PLACE: what is wrong`.
    """

    def __init__(self, problems: Sequence[str]) -> None:
        super().__init__("\n".join(problems))
        self.problems = tuple(problems)


@dataclass(frozen=True, slots=True)
class Node:
    """A value in a JSON file.

    Every method raises `GoldenError` if the value is not what it is taken for.

    Attributes:
        file: name of the file, for messages.
        place: e.g. `[3].queries[0].tx`; empty for the whole file.
        value: as `json` reads it.
    """

    file: str
    place: str
    value: Any

    def __getitem__(self, key: str) -> "Node":
        """The member `key` of an object."""
        members = self._of(dict, "an object")
        if key not in members:
            raise self.problem(f"`{key}` is missing")
        place = f"{self.place}.{key}" if self.place else key
        return Node(self.file, place, members[key])

    def __contains__(self, key: str) -> bool:
        """Whether an object has the member `key`."""
        return key in self._of(dict, "an object")

    def __iter__(self) -> Iterator["Node"]:
        """Go through the elements of a list."""
        for k, value in enumerate(self._of(list, "a list")):
            yield Node(self.file, f"{self.place}[{k}]", value)

    def filled(self) -> list["Node"]:
        """The elements of a list, which must not be empty."""
        elements = list(self)
        if not elements:
            raise self.problem("must not be empty")
        return elements

    def text(self) -> str:
        """The value, which must be a string."""
        text: str = self._of(str, "a text")
        return text

    def number(self) -> float:
        """The value, which must be a finite number."""
        if isinstance(self.value, bool) or not isinstance(self.value, int | float):
            raise self.problem(f"must be a number, not {self._shown()}")
        if not math.isfinite(self.value):
            raise self.problem(f"must be finite, not {self.value}")
        return float(self.value)

    def positive(self) -> float:
        """The value, which must be a number above 0."""
        number = self.number()
        if number <= 0:
            raise self.problem(f"must be positive, not {self.value}")
        return number

    def whole(self) -> int:
        """The value, which must be an integer; `3.0` is one."""
        number = self.number()
        if not number.is_integer():
            raise self.problem(f"must be a whole number, not {self.value}")
        return int(number)

    def numbers(self, count: int | None = None) -> list[float]:
        """The value, which must be a list of `count` finite numbers, or of any number of them."""
        found = [node.number() for node in self]
        if count is not None and len(found) != count:
            raise self.problem(f"must be {count} numbers, not {len(found)}")
        return found

    def ring(self) -> list[list[float]]:
        """The value, which must be a list of three corners [m] or more, of two numbers each."""
        corners = [corner.numbers(2) for corner in self]
        if len(corners) < 3:
            raise self.problem(f"a building has 3 corners at least, not {len(corners)}")
        return corners

    @property
    def case(self) -> str:
        """Where this golden case stands, and the `id` that its file gives it."""
        return f"{self.file}: {self.place} (id {self['id'].value if 'id' in self else '?'})"

    def problem(self, what: str) -> GoldenError:
        """The error that says `what` is wrong here."""
        place = f"{self.place}: " if self.place else ""
        return GoldenError([f"{self.file}: {place}{what}"])

    def _of(self, kind: type, name: str) -> Any:
        if not isinstance(self.value, kind):
            raise self.problem(f"must be {name}, not {self._shown()}")
        return self.value

    def _shown(self) -> str:
        text = json.dumps(self.value)
        return text if len(text) <= 40 else f"{text[:37]}..."


def read_json(path: Path, name: str) -> Node:
    """Read the JSON file at `path`, called `name` in messages.

    Raises:
        GoldenError: it cannot be read or is no JSON; the message names line and column.
    """
    try:
        return Node(name, "", json.loads(path.read_text(encoding="utf-8")))
    except json.JSONDecodeError as error:
        raise GoldenError([f"{name}:{error.lineno}:{error.colno}: {error.msg}"]) from error
    except (OSError, UnicodeDecodeError, RecursionError) as error:
        raise GoldenError([f"{name}: cannot be read: {error}"]) from error


Column = Callable[[Sequence[str]], Array]
"""Turns the cells of a column into an array; raises `ValueError` for a wrong one."""


def text(cells: Sequence[str]) -> Array:
    """Turn cells into non-empty strings, shape (cells,)."""
    if not all(cells):
        raise ValueError("must not be empty")
    return np.array(cells, object)


def number(cells: Sequence[str]) -> Array:
    """Turn cells into finite numbers, shape (cells,)."""
    values = np.array(cells, np.str_).astype(float)
    if not np.isfinite(values).all():
        raise ValueError("must be finite")
    return values


def number_or_empty(cells: Sequence[str]) -> Array:
    """Turn cells into finite numbers, NaN where there is nothing, shape (cells,)."""
    filled = number([cell or "0" for cell in cells])
    return np.where([not cell for cell in cells], np.nan, filled)


def whole(cells: Sequence[str]) -> Array:
    """Turn cells into integers, shape (cells,)."""
    values = number(cells)
    if (values != np.round(values)).any():
        raise ValueError("must be a whole number")
    return values.astype(np.int64)


def nanoseconds(cells: Sequence[str]) -> Array:
    """Turn cells with times in seconds into whole nanoseconds [ns], shape (cells,)."""
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
        """The column of that name, shape (rows,)."""
        return self.columns[column]

    def __len__(self) -> int:
        """The number of rows."""
        return len(next(iter(self.columns.values())))

    def place(self, row: int) -> str:
        """File and line of row `row`, counted from 0."""
        return f"{self.name}:{row + 2}"

    def problem(self, row: int, what: str) -> GoldenError:
        """The error that says `what` is wrong with row `row`, counted from 0."""
        return GoldenError([f"{self.place(row)}: {what}"])

    def numbers_of(self, column: str, known: Mapping[str, int]) -> Array:
        """Replace the names in a column by their numbers.

        Args:
            column: holds names.
            known: the number of each name.

        Returns:
            Numbers, shape (rows,).

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
    """Read some columns of a CSV file.

    Args:
        path: of the file, compressed if it ends with `.gz`.
        name: of the file in messages.
        columns: what turns the cells of each column into an array, by the name in the header.

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
    """Yield the name and the cells of each column."""
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
