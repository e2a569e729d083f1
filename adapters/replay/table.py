"""Tables of positions over time: CSV and Parquet files, sorted by time."""

import csv
import difflib
import io
from collections.abc import Iterable, Iterator, Sequence
from itertools import groupby
from operator import itemgetter
from pathlib import Path
from typing import Any, Final, TypeAlias

from adapters.replay.files import noting_faults, opened
from adapters.replay.findings import Findings, Place
from adapters.replay.snapshot import MOTION, SIZE, Cell, Snapshot, file_time, read_snapshot
from orchestrator.installed import module_of_extra
from orchestrator.timebase import Time

PARQUET: Final = ".parquet"

_TIME: Final = "time"
_REQUIRED: Final = ("id", _TIME, *MOTION, "type")
_KNOWN: Final = (*_REQUIRED, *SIZE)
_ROWS: Final = 1 << 14
"""Rows of a Parquet file that are read at once."""

_Row: TypeAlias = tuple[Place, Sequence[Cell]]


def read_csv(path: Path, findings: Findings) -> Iterator[Snapshot]:
    """The snapshots of a CSV file, in its order; units and reference point as in the file.

    Args:
        path: of the file, UTF-8, which may be compressed (`*.gz`). Its first line names the
            columns; they are separated by commas, or by semicolons if there is one in this line.
        findings: takes what is wrong with it.
    """
    with noting_faults(findings), opened(path) as stream:
        lines = io.TextIOWrapper(stream, encoding="utf-8-sig", newline="")
        try:
            header = lines.readline()
            delimiter = ";" if ";" in header else ","
            names = [name.strip() for name in next(csv.reader([header], delimiter=delimiter), [])]
            if not names:
                findings.note((1, 1), "there is no line that names the columns")
            elif _have_columns(names, findings):
                rows = _csv_rows(csv.reader(lines, delimiter=delimiter), len(names), findings)
                yield from _snapshots(names, rows, findings)
        except UnicodeDecodeError as error:
            findings.note((1, 1), f"is not UTF-8 text: {error}")


def read_parquet(path: Path, findings: Findings) -> Iterator[Snapshot]:
    """The snapshots of a Parquet file, in its order; units and reference point as in the file.

    Args:
        path: of the file.
        findings: takes what is wrong with it.

    Raises:
        ComponentTypeError: the extra `parquet` is not installed.
    """
    parquet = _parquet()
    try:
        file = parquet.ParquetFile(path)
        names = file.schema_arrow.names
    except Exception as error:  # pyarrow raises what it likes, depending on the byte
        findings.note((1, 1), f"cannot be read: {error}")
        return
    with file:
        if _have_columns(names, findings):
            used = [name for name in names if name in _KNOWN]
            yield from _snapshots(used, _parquet_rows(file, used, findings), findings)


def _parquet() -> Any:
    return module_of_extra(
        "pyarrow.parquet", "Parquet files", extra="parquet", otherwise="or use a CSV file"
    )


def _have_columns(names: Sequence[str], findings: Findings) -> bool:
    """Whether all columns are there, once; which are not is noted."""
    missing = [name for name in _REQUIRED if name not in names]
    others = [name for name in names if name not in _KNOWN]
    for name in missing:
        close = difflib.get_close_matches(name, others, n=1)
        hint = f"is `{close[0]}` meant?" if close else f"there are: {', '.join(names)}"
        findings.note((1, 1), f"there is no column `{name}`; {hint}")
    for name in others:
        absent = [known for known in SIZE if known not in names]
        close = difflib.get_close_matches(name, absent, n=1, cutoff=0.8)
        if close:
            findings.note((1, 1), f"column `{name}` is not known; is `{close[0]}` meant?")
    twice = sorted({name for name in names if name in _KNOWN and names.count(name) > 1})
    for name in twice:
        findings.note((1, 1), f"the column `{name}` is there twice")
    return not findings


def _csv_rows(reader: Any, width: int, findings: Findings) -> Iterator[_Row]:
    try:
        for row in reader:
            place = (reader.line_num + 1, 1)  # the header was read before
            if len(row) == width:
                yield place, [cell.strip() or None for cell in row]
            elif row:
                findings.note(place, f"{len(row)} cells, but there are {width} columns")
    except csv.Error as error:
        findings.note((reader.line_num + 1, 1), f"is no line of a CSV file: {error}")


def _parquet_rows(file: Any, names: Sequence[str], findings: Findings) -> Iterator[_Row]:
    number = 0
    try:
        for batch in file.iter_batches(batch_size=_ROWS, columns=names, use_threads=False):
            columns = [batch.column(name).to_pylist() for name in names]
            for row in zip(*columns, strict=True):
                number += 1
                yield (number, 1), row
    except Exception as error:  # as above
        findings.note((number + 1, 1), f"cannot be read: {error}")


def _snapshots(
    names: Sequence[str], rows: Iterable[_Row], findings: Findings
) -> Iterator[Snapshot]:
    """Rows that follow each other and have one time are a snapshot."""
    timed = _timed(names.index(_TIME), rows, findings)
    for time, group in groupby(timed, key=itemgetter(0)):
        _, places, cells = zip(*group, strict=True)
        columns = dict(zip(names, zip(*cells, strict=True), strict=True))
        yield read_snapshot(time, columns, places, findings, place=places[0], labels={})


def _timed(
    index: int, rows: Iterable[_Row], findings: Findings
) -> Iterator[tuple[Time, Place, Sequence[Cell]]]:
    written: Cell = None
    time: Time | None = None
    for place, cells in rows:
        if time is None or cells[index] != written:
            written = cells[index]
            time = None if written is None else file_time(written)
        if time is None:
            what = "is missing" if written is None else f"is `{written}`, no number of seconds"
            findings.note(place, f"`{_TIME}` {what}")
        else:
            yield time, place, cells
