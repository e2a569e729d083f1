"""Tables in files, CSV or Parquet, that remember where every cell was written."""

import csv
import importlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, TypeAlias

from orchestrator.errors import ComponentTypeError, Location, Problem
from orchestrator.installed import module_of_extra
from orchestrator.suggestion import suggestion

Cell: TypeAlias = str | int | float | None
"""Text in CSV files, text or a number in Parquet files; `None` where nothing is written."""

PARQUET: Final = ".parquet"


class TableError(ComponentTypeError):
    """What is wrong with a file, one line `file:line:column: problem` each.

    Args:
        problems: those to be shown.
        more: how many more there are.
    """

    def __init__(self, problems: Sequence[Problem], more: int = 0) -> None:
        lines = [str(problem) for problem in problems]
        if more:
            lines.append(f"... and {more} more problems in this file")
        super().__init__("\n".join(lines))


@dataclass(frozen=True, slots=True)
class Table:
    """Named columns of equal length.

    Attributes:
        file: its path.
        columns: cells by name, in the order of the file.
        lines: the line of each row, counted from 1; in Parquet files the number of the row.
        header: the line of the names.
        ragged: line and problem of rows that do not fit the header; they are in no column.
    """

    file: Path
    columns: Mapping[str, Sequence[Cell]]
    lines: Sequence[int]
    header: int = 1
    ragged: Sequence[tuple[int, str]] = ()

    def __len__(self) -> int:
        return len(self.lines)

    def place(self, row: int | None, column: str | None = None) -> Location:
        """Where a cell stands; without a row its column's name, without a column the first.

        In a Parquet file the number of the row and of the column, names in row 1.
        """
        line = self.header if row is None else self.lines[row]
        index = 0 if column is None else list(self.columns).index(column)
        if self.file.suffix == PARQUET:
            return Location(str(self.file), line, index + 1)
        return Location(str(self.file), line, _character(self.file, line, index))


def read_table(path: Path) -> Table:
    """Read a file; its type is told by its name.

    A CSV file is UTF-8, with commas; lines that are empty or begin with `#` are skipped, the
    first other line names the columns.

    Args:
        path: of the file; `*.parquet` needs the extra `nlosim[parquet]`, all else is CSV.

    Raises:
        TableError: the file cannot be read.
        ComponentTypeError: it is a Parquet file, and the extra is not installed.
    """
    try:
        return _read_parquet(path) if path.suffix == PARQUET else _read_csv(path)
    except OSError as error:
        raise _unreadable(path, error.strerror or str(error)) from None


def check_columns(table: Table, required: Sequence[str], optional: Sequence[str]) -> None:
    """Refuse a table that lacks a required column, or has one that nobody knows.

    Raises:
        TableError: all such columns.
    """
    known = (*required, *optional)
    problems = [
        Problem(table.place(None, name), f"there is no column `{name}`; {suggestion(name, known)}")
        for name in table.columns
        if name not in known
    ]
    problems += [
        Problem(table.place(None), f"the column `{name}` is missing")
        for name in required
        if name not in table.columns
    ]
    if problems:
        raise TableError(problems)


def parquet() -> Any:
    """The module `pyarrow.parquet`.

    Raises:
        ComponentTypeError: it is not installed.
    """
    return module_of_extra(
        "pyarrow.parquet", "Parquet files", extra="parquet", otherwise="or use a CSV file"
    )


def _unreadable(path: Path, reason: str) -> TableError:
    return TableError([Problem(Location(str(path), 1, 1), f"cannot be read: {reason}")])


def _read_parquet(path: Path) -> Table:
    module = parquet()
    try:
        read = module.read_table(path)
        columns = read.to_pydict()
    except OSError:
        raise
    except Exception as error:  # pyarrow raises what it likes, depending on the byte
        raise _unreadable(path, str(error)) from None
    types = importlib.import_module("pyarrow").types
    problems = [
        Problem(
            Location(str(path), 1, number),
            f"the column `{field.name}` holds {field.type}; write one number or text in each row",
        )
        for number, field in enumerate(read.schema, 1)
        if types.is_nested(field.type)
    ]
    if problems:
        raise TableError(problems)
    rows = len(next(iter(columns.values()), ()))
    return Table(path, columns, range(1, rows + 1))


def _rows(path: Path) -> Iterator[tuple[int, list[str]]]:
    """Line and cells of each row, the names included.

    Raises:
        TableError: the file is no text.
    """
    with path.open(encoding="utf-8-sig", newline="") as file:
        lines = ("\n" if line.startswith("#") else line for line in file)
        reader = csv.reader(lines, strict=True, skipinitialspace=True)
        try:
            for row in reader:
                if row:
                    yield reader.line_num, row
        except UnicodeDecodeError as error:
            raise _unreadable(path, f"it is not UTF-8 text ({error})") from None
        except csv.Error as error:
            where = Location(str(path), reader.line_num, 1)
            raise TableError([Problem(where, f"is no line of a CSV file: {error}")]) from None


def _read_csv(path: Path) -> Table:
    rows = _rows(path)
    header, cells = next(rows, (1, []))
    names = _named(path, cells)
    lines: list[int] = []
    ragged: list[tuple[int, str]] = []
    columns: list[list[Cell]] = [[] for _ in names]
    for line, row in rows:
        if len(row) != len(names):
            ragged.append((line, f"{len(row)} cells, but there are {len(names)} columns"))
            continue
        lines.append(line)
        for column, cell in zip(columns, row, strict=True):
            column.append(cell.strip() or None)
    return Table(path, dict(zip(names, columns, strict=True)), lines, header, ragged)


def _named(path: Path, cells: Sequence[str]) -> tuple[str, ...]:
    """The names in the first row.

    Raises:
        TableError: there are none, or one stands twice.
    """
    names = tuple(cell.strip() for cell in cells)
    if not names:
        raise _unreadable(path, "there is no line that names the columns")
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise _unreadable(path, f"the column `{twice[0]}` stands twice")
    return names


def _character(path: Path, line: int, index: int) -> int:
    """Where the cell `index` of a line begins, counted from 1; only messages need it."""
    with path.open(encoding="utf-8-sig", newline="") as file:
        text = next((text for number, text in enumerate(file, 1) if number == line), "")
    column, is_quoted = 0, False
    for position, character in enumerate(text):
        if column == index:
            return position + 1
        is_quoted ^= character == '"'
        column += character == "," and not is_quoted
    return len(text.rstrip("\r\n")) + 1 if column == index else 1
