"""Results of finished runs and experiments, for notebooks and scripts.

from orchestrator import frames
frames("runs/city-1")["prr-distance"]     # a pandas DataFrame
"""

import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from orchestrator.recording.layout import RecordingError
from orchestrator.recording.reader import Series
from orchestrator.signal import Array
from orchestrator.table_files import read_table, unit_of

if TYPE_CHECKING:
    from pandas import DataFrame

_SUFFIXES: Final = (".csv", ".parquet")
"""Suffixes of tables; of two files with one table the first is read."""


def metrics(directory: Path | str) -> dict[str, Any]:
    """The metrics of a run in one level, `measures.prr.prr`, as experiments name them.

    Args:
        directory: of a run.

    Raises:
        RecordingError: there are none.
    """
    path = Path(directory) / "metrics.json"
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise RecordingError(
            f"`{directory}` has no `{path.name}`; `nlosim report` makes it"
        ) from None
    return dict(_flat(found, ""))


def tables_of(directory: Path | str) -> dict[str, dict[str, Array]]:
    """The tables of a run or an experiment.

    Args:
        directory: of a run, or of an experiment.

    Returns:
        By name, `prr-distance` of a run, `runs`, `summary` and those in `report` of an experiment:
        columns by name, shape (row,) each; NaN is what is not known.

    Raises:
        MissingParquetError: a table is in a Parquet file only, and pyarrow is not installed.
        RecordingError: there is no table.
    """
    found = {path.stem: read_table(path) for path in _files(Path(directory))}
    if not found:
        raise RecordingError(
            f"`{directory}` has no tables; `nlosim report {directory} --measures all` makes them"
        )
    return found


def frames(directory: Path | str) -> "dict[str, DataFrame]":
    """The tables of a run or an experiment as pandas data frames; see `tables_of`.

    The units of columns are in `attrs["units"]` of each frame.
    """
    return {name: _frame(table) for name, table in tables_of(directory).items()}


def frame(series: Series) -> "DataFrame":
    """A recorded signal as a pandas data frame.

    Args:
        series: of numbers, with a constant shape: `Recording(DIRECTORY)["traffic.ego.speed"]`.

    Returns:
        A row for each sample, by time [s]; one column, or one for each element. `attrs["unit"]` is
        the unit.

    Raises:
        ValueError: the shape of the signal varies, or it is binary.
    """
    from pandas import DataFrame, Index  # noqa: PLC0415 - not a dependency

    values = np.asarray(series.values)
    if ("[" in series.kind and len(values) != len(series)) or values.dtype.kind not in "biuf":
        raise ValueError(f"`{series.name}` is {series.kind}, which is no table; read its samples")
    flat = values.reshape(len(series), -1)
    single = flat.shape[1] == 1
    names = [series.name] if single else [f"{series.name}[{k}]" for k in range(flat.shape[1])]
    made = DataFrame(flat, columns=names, index=Index(series.times * 1e-9, name="time_s"))
    made.attrs["unit"] = series.unit
    return made


def _frame(table: Mapping[str, Array]) -> "DataFrame":
    from pandas import DataFrame  # noqa: PLC0415 - not a dependency

    made = DataFrame(dict(table))
    made.attrs["units"] = {name: unit_of(name) for name in table}
    return made


def _files(directory: Path) -> Iterator[Path]:
    for folder in (directory / "measures", directory, directory / "report"):
        for suffix in _SUFFIXES:
            for path in sorted(folder.glob(f"*{suffix}")):
                if suffix == _SUFFIXES[0] or not path.with_suffix(_SUFFIXES[0]).exists():
                    yield path


def _flat(found: Mapping[str, Any], prefix: str) -> Iterator[tuple[str, Any]]:
    for key, value in found.items():
        if isinstance(value, dict):
            yield from _flat(value, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}", value
