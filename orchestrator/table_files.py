"""Tables of measures in files: CSV for everybody, Parquet for programs."""

import csv
import importlib
import importlib.util
import math
import re
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from itertools import chain
from pathlib import Path
from typing import Any, Final, Literal, TypeAlias, get_args

import numpy as np

from orchestrator.errors import CosimError
from orchestrator.signal import Array

Table: TypeAlias = Mapping[str, Array]
"""Columns by name, each of shape (row,)."""

Blocks: TypeAlias = Callable[[], Iterator[Table]]
"""Yields a long table in parts, one beneath the other, with the same columns; one at least."""

Format: TypeAlias = Literal["csv", "parquet"]
"""A kind of file; its name is the suffix."""

FORMATS: Final[tuple[Format, ...]] = get_args(Format)
NO_PARQUET: Final = (
    "`parquet` needs `pyarrow`, which is not installed: pip install 'nlosim[parquet]'"
)

UNITS: Final = {"_kbit_s": "kbit/s", "_ms": "ms", "_ns": "ns", "_m": "m", "_s": "s"}
"""Units by the endings of names that have them."""

_BRACKETS: Final = re.compile(r".*\s\[([^\[\]]+)\]")


class MissingParquetError(CosimError):
    """Parquet was asked for, and pyarrow is not installed. Exit code 2."""


def has_parquet() -> bool:
    """Whether Parquet files can be written and read here."""
    return importlib.util.find_spec("pyarrow") is not None


def chosen(said: Sequence[Format] | None) -> tuple[Format, ...]:
    """The formats to write: those that were asked for, else CSV and, if it can be had, Parquet.

    Raises:
        MissingParquetError: Parquet was asked for and cannot be had.
    """
    if said is None:
        return FORMATS if has_parquet() else ("csv",)
    if "parquet" in said and not has_parquet():
        raise MissingParquetError(NO_PARQUET)
    return tuple(said)


def unit_of(column: str) -> str:
    """The unit in a heading such as `v [km/h]`, or that the ending of a name says.

    It is `1` for pure numbers and for text.
    """
    if match := _BRACKETS.fullmatch(column):
        return match[1]
    endings = (unit for ending, unit in UNITS.items() if column.endswith(ending))
    return next(endings, "1")


def write_tables(
    tables: Mapping[str, Table | Blocks], folder: Path, formats: Collection[Format]
) -> Iterator[Path]:
    """Write tables as files of their names into `folder`; yields the files.

    Files of these names in other formats are removed, as they would be of another run.
    """
    for name, table in tables.items():
        folder.mkdir(exist_ok=True)
        for suffix in FORMATS:
            path = folder / f"{name}.{suffix}"
            if suffix not in formats:
                path.unlink(missing_ok=True)
                continue
            write_table(table, path)
            yield path


def write_table(table: Table | Blocks, path: Path, units: Mapping[str, str] | None = None) -> None:
    """Write a table, or its parts, to a file, as Parquet if its suffix says so, else as CSV.

    Args:
        table: to be written.
        path: of the file.
        units: of the columns, by name: they are in the metadata of Parquet, and in the heading of
            CSV, `v [m/s]`; `None`: what the names of the columns say.

    Raises:
        MissingParquetError: it is to be Parquet, and pyarrow is not installed.
        OSError: it cannot be written.
    """
    parts = table() if callable(table) else iter([table])
    (_write_parquet if path.suffix == ".parquet" else _write_csv)(parts, path, units)


def read_table(path: Path) -> dict[str, Array]:
    """A table in a CSV or Parquet file that `write_tables` wrote.

    Args:
        path: of the file, `.csv` or `.parquet`.

    Returns:
        Columns by name: int64 if all fields are whole numbers, float64 with NaN for empty fields if
        they are numbers, bool or text; shape (row,) each.

    Raises:
        MissingParquetError: it is a Parquet file, and pyarrow is not installed.
        FileNotFoundError: there is no such file.
    """
    if path.suffix == ".parquet":
        return _read_parquet(path)
    with path.open(encoding="utf-8", newline="") as file:
        header, *rows = list(csv.reader(file))
    columns = zip(*rows, strict=True) if rows else ([] for _ in header)
    return {name: _column(list(fields)) for name, fields in zip(header, columns, strict=True)}


def _write_csv(parts: Iterator[Table], path: Path, units: Mapping[str, str] | None) -> None:
    first = next(parts)
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(_heading(name, units) for name in first)
        for part in chain([first], parts):
            writer.writerows(zip(*map(_fields, part.values()), strict=True))


def _heading(name: str, units: Mapping[str, str] | None) -> str:
    unit = (units or {}).get(name, "1")
    return name if unit == "1" else f"{name} [{unit}]"


def _fields(column: Array) -> list[Any]:
    values = np.asarray(column)
    if values.dtype.kind != "f" or not np.isnan(values).any():
        return list(values.tolist())
    return ["" if math.isnan(each) else each for each in values.tolist()]


def _column(fields: list[str]) -> Array:
    if fields and all(field in {"True", "False"} for field in fields):
        return np.array([field == "True" for field in fields])
    for kind in (int, float):
        try:
            values = [kind(field) if field or kind is int else math.nan for field in fields]
            return np.array(values, np.int64 if kind is int else np.float64)
        except ValueError:
            continue
    return np.array(fields, dtype=np.str_)


def _write_parquet(parts: Iterator[Table], path: Path, units: Mapping[str, str] | None) -> None:
    """NaN becomes null; every column has its unit in its metadata, under `unit`."""
    arrow, parquet = _pyarrow()
    first = next(parts)
    fields = [
        arrow.field(name, _arrow(arrow, column).type, metadata={"unit": _unit(name, units)})
        for name, column in first.items()
    ]
    schema = arrow.schema(fields)
    with parquet.ParquetWriter(path, schema) as writer:
        for part in chain([first], parts):
            arrays = [_arrow(arrow, column) for column in part.values()]
            writer.write_table(arrow.Table.from_arrays(arrays, schema=schema))


def _unit(name: str, units: Mapping[str, str] | None) -> str:
    return unit_of(name) if units is None else units[name]


def _arrow(arrow: Any, column: Array) -> Any:
    """A column in the form of Arrow, NaN as null.

    It is handed over as it lies: what converts it would load pandas where it is installed.
    """
    values = np.ascontiguousarray(column)
    kind, count = values.dtype.kind, len(values)
    if kind == "U":
        return _arrow_text(arrow, values.tolist())
    if kind not in "biuf" or not values.dtype.isnative:
        return arrow.array(values, from_pandas=True)
    known = ~np.isnan(values) if kind == "f" else np.ones(count, np.bool_)
    mask = None if known.all() else arrow.py_buffer(np.packbits(known, bitorder="little"))
    data = np.packbits(values, bitorder="little") if kind == "b" else values
    type_ = arrow.from_numpy_dtype(values.dtype)
    return arrow.Array.from_buffers(type_, count, [mask, arrow.py_buffer(data)])


def _arrow_text(arrow: Any, texts: Sequence[str]) -> Any:
    """The texts one after the other, and where each ends."""
    encoded = [text.encode() for text in texts]
    ends = np.cumsum([0, *map(len, encoded)], dtype=np.int32)
    buffers = [None, arrow.py_buffer(ends), arrow.py_buffer(b"".join(encoded))]
    return arrow.Array.from_buffers(arrow.string(), len(encoded), buffers)


def _read_parquet(path: Path) -> dict[str, Array]:
    _, parquet = _pyarrow()
    table = parquet.read_table(path)
    return {name: _plain(table.column(name)) for name in table.column_names}


def _plain(column: Any) -> Array:
    values = np.asarray(column.to_numpy(zero_copy_only=False))
    return values.astype(np.str_) if values.dtype == object else values


def _pyarrow() -> tuple[Any, Any]:
    if not has_parquet():
        raise MissingParquetError(NO_PARQUET)
    return importlib.import_module("pyarrow"), importlib.import_module("pyarrow.parquet")
