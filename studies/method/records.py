"""Records in files: tables as CSV, everything else as JSON.

A table is a list of records of one dataclass. What a field becomes, its type says:

    str, int, float, bool    a column; an empty cell is a `None` that the type allows
    Estimate                 three columns: the name, and the name with `_low` and `_high`
    a dataclass              the columns of its fields
    Mapping[str, str]        a column per key, e.g. the levels of factors

A field that has a default value need not be in the file that is read; a mapping has the columns
that no other field has.
"""

import abc
import csv
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import MISSING, dataclass, fields, is_dataclass
from functools import cache
from pathlib import Path
from types import NoneType
from typing import Any, Final, TypeVar, get_args, get_origin, get_type_hints

from pydantic import TypeAdapter
from typing_extensions import override

from orchestrator.experiment.report import Row
from orchestrator.intervals import Estimate

R = TypeVar("R")

Cells = Mapping[str, str]
"""The text of some cells of a line, by column."""


def rows(table: Iterable[object], *, without: Collection[str] = ()) -> list[Row]:
    """The records of `table`, as values by column; columns in `without` are left out."""
    found = (_Record(type(record)).cells("", record) for record in table)
    return [{k: v for k, v in row.items() if k not in without} for row in found]


def write(path: Path, table: Sequence[Row]) -> None:
    """Write `table`, whose rows have the same columns; an empty one makes an empty file."""
    with path.open("w", newline="", encoding="utf-8") as file:
        if table:
            writer = csv.DictWriter(file, list(table[0]), lineterminator="\n")
            writer.writeheader()
            writer.writerows([{k: _rounded(v) for k, v in row.items()} for row in table])


def read(path: Path, kind: type[R]) -> list[R]:
    """The records that were written to `path`; columns that `kind` does not have are left out.

    Raises:
        FileNotFoundError: there is no such file.
        ValueError: it is not a table of such records; names the file and the line.
    """
    found: list[R] = []
    with path.open(newline="", encoding="utf-8") as file:
        for line, cells in enumerate(csv.DictReader(file), start=2):
            try:
                found.append(_Record(kind).value("", cells))
            except KeyError as error:
                what = f"there is no column {error}; run the report again"
                raise ValueError(f"{path}: {what}") from None
            except ValueError as error:
                raise ValueError(f"{path}:{line}: {error}") from None
    return found


def read_json(path: Path, kind: type[R]) -> R:
    """The record in a JSON file, as `dataclasses.asdict` makes it.

    Raises:
        FileNotFoundError: there is no such file.
        ValueError: it does not hold such a record.
    """
    return TypeAdapter(kind).validate_json(path.read_bytes())


def from_json(content: Mapping[str, Any], kind: type[R]) -> R:
    """The record that `dataclasses.asdict` made `content` of.

    Raises:
        ValueError: it is not of such a record.
    """
    return TypeAdapter(kind).validate_python(content)


def _rounded(value: object) -> object:
    """Numbers with six digits behind the point, more than any of them means."""
    return round(value, 6) + 0.0 if isinstance(value, float) else value  # no `-0.0`


class _Columns(abc.ABC):
    """How a field stands in a table."""

    @abc.abstractmethod
    def names(self, field: str) -> list[str]:
        """The columns that the field always has."""

    @abc.abstractmethod
    def cells(self, field: str, value: Any) -> dict[str, Any]:
        """What stands in the columns."""

    @abc.abstractmethod
    def value(self, field: str, cells: Cells) -> Any:
        """What the columns say.

        Raises:
            KeyError: a column is missing.
            ValueError: a cell is not what it should be.
        """


@dataclass(frozen=True, slots=True)
class _Cell(_Columns):
    """One column.

    Attributes:
        parse: reads the text of a cell.
        is_optional: whether an empty cell is `None`.
    """

    parse: Callable[[str], Any]
    is_optional: bool

    @override
    def names(self, field: str) -> list[str]:
        return [field]

    @override
    def cells(self, field: str, value: Any) -> dict[str, Any]:
        return {field: value}

    @override
    def value(self, field: str, cells: Cells) -> Any:
        text = cells[field]
        return None if self.is_optional and not text else self.parse(text)


@dataclass(frozen=True, slots=True)
class _Interval(_Columns):
    """The columns of an estimate that there may be."""

    @override
    def names(self, field: str) -> list[str]:
        return [field, f"{field}_low", f"{field}_high"]

    @override
    def cells(self, field: str, value: Estimate | None) -> dict[str, Any]:
        each = (None, None, None) if value is None else (value.value, value.low, value.high)
        return dict(zip(self.names(field), each, strict=True))

    @override
    def value(self, field: str, cells: Cells) -> Estimate | None:
        found, *bounds = (float(cells[name]) if cells[name] else None for name in self.names(field))
        return None if found is None else Estimate(found, *bounds)


@dataclass(frozen=True, slots=True)
class _Levels(_Columns):
    """A column per key of a mapping; which keys it has, only the table says."""

    @override
    def names(self, field: str) -> list[str]:
        return []

    @override
    def cells(self, field: str, value: Mapping[str, str]) -> dict[str, Any]:
        return dict(value)

    @override
    def value(self, field: str, cells: Cells) -> dict[str, str]:
        return dict(cells)


@dataclass(frozen=True, slots=True)
class _Record(_Columns):
    """The columns of the fields of a dataclass, in their order."""

    kind: type

    @override
    def names(self, field: str) -> list[str]:
        return [name for own, columns in _fields(self.kind).items() for name in columns.names(own)]

    @override
    def cells(self, field: str, value: Any) -> dict[str, Any]:
        return {
            name: cell
            for own, columns in _fields(self.kind).items()
            for name, cell in columns.cells(own, getattr(value, own)).items()
        }

    @override
    def value(self, field: str, cells: Cells) -> Any:
        known = _fields(self.kind)
        own = {name for each, columns in known.items() for name in columns.names(each)}
        others = {name: cell for name, cell in cells.items() if name not in own}
        return self.kind(
            **{
                each: columns.value(each, cells if columns.names(each) else others)
                for each, columns in known.items()
                if each not in _defaults(self.kind) or cells.keys() >= set(columns.names(each))
            }
        )


@cache
def _defaults(kind: Any) -> frozenset[str]:
    return frozenset(each.name for each in fields(kind) if each.default is not MISSING)


@cache
def _fields(kind: type) -> dict[str, _Columns]:
    """How the fields of a dataclass stand in a table."""
    return {name: _columns(each) for name, each in get_type_hints(kind).items()}


def _columns(kind: Any) -> _Columns:
    """How a field of type `kind` stands in a table."""
    if get_origin(kind) is Mapping:
        return _Levels()
    options = [each for each in get_args(kind) if each is not NoneType] or [kind]
    if options == [Estimate]:
        return _Interval()
    if isinstance(kind, type) and is_dataclass(kind):
        return _Record(kind)
    (only,) = options
    return _Cell(_PARSERS[only], NoneType in get_args(kind))


def _truth(cell: str) -> bool:
    if cell not in ("True", "False"):
        raise ValueError(f"expected `True`, `False` or nothing, got `{cell}`")
    return cell == "True"


_PARSERS: Final[Mapping[type, Callable[[str], Any]]] = {
    str: str,
    int: int,
    float: float,
    bool: _truth,
}
