"""Signals as tables in CSV or Parquet files."""

from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Final

from orchestrator.recording.tidy import Lost, TidyTable, chosen, tidy_tables
from orchestrator.table_files import (
    NO_PARQUET,
    MissingParquetError,
    Table,
    has_parquet,
    write_table,
)
from studies.exports.export import Asked, Exported, Format
from studies.exports.outputs import ExportError


def write(asked: Asked, draft: Path, suffix: str) -> Exported:
    """Write a folder with a file for each table.

    Args:
        asked: of which run, and which of its signals.
        draft: the folder, which is created.
        suffix: of the files: `csv` or `parquet`.

    Raises:
        RecordingError: a signal that was asked for is not recorded.
        ExportError: nothing can be a table.
    """
    found = tidy_tables(asked.recording, chosen(asked.recording, asked.signals))
    if not found.tables:
        raise ExportError("; ".join(found.left_out) or "nothing was recorded")
    draft.mkdir()
    lost, files = Lost.nothing(), {}
    for table in found.tables:
        counted = _Counted(table, lost)
        name = f"{table.name}.{suffix}"
        write_table(counted.parts, draft / name, table.units)
        rows = f"{counted.rows} row{'' if counted.rows == 1 else 's'}"
        files[name] = f"{rows} of {len(table.units)} columns"
    return Exported(files=files, left_out=(*found.left_out, *lost.said))


class _Counted:
    """A table whose rows are counted as they are read."""

    def __init__(self, table: TidyTable, lost: Lost) -> None:
        self.rows = 0
        self._table = table
        self._lost = lost

    def parts(self) -> Iterator[Table]:
        for part in self._table.blocks(self._lost):
            self.rows += len(next(iter(part.values())))
            yield part


def _check_parquet() -> None:
    if not has_parquet():
        raise MissingParquetError(NO_PARQUET)


FORMATS: Final = {
    "csv": Format("csv", partial(write, suffix="csv")),
    "parquet": Format("parquet", partial(write, suffix="parquet"), _check_parquet),
}
