"""Recorded signals for pandas and xarray."""

import importlib
import math
import re
from collections.abc import Mapping, Sequence
from types import ModuleType
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from orchestrator.recording.layout import RecordingError
from orchestrator.recording.reader import Recording
from orchestrator.recording.tidy import TIME, Lost, TidyTable, chosen, tidy_tables
from orchestrator.signal import Array

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

_EXTRA: Final = "frames"
_ELEMENT: Final = re.compile(r"(?P<name>.*[^\[\]])\[(?P<places>[\d, ]+)\]")

_MOST: Final = 1 << 28
"""Elements of an array that is filled up."""


def frame(recording: Recording, signals: Sequence[str]) -> "pd.DataFrame":
    """Signals of one table as a data frame; see `Recording.frame`."""
    pandas = _module("pandas", "a data frame")
    table = _one_table(recording, signals)
    found = pandas.DataFrame({name: _native(column) for name, column in _read(table).items()})
    found.attrs["units"] = dict(table.units)
    return found


def dataset(recording: Recording, signals: Sequence[str]) -> "xr.Dataset":
    """Signals of one table as labelled arrays; see `Recording.dataset`."""
    xarray = _module("xarray", "a dataset")
    table = _one_table(recording, signals)
    columns = _read(table)
    if table.keys == (TIME,) and len(columns[TIME]) != len(table.times):
        return _of_records(xarray, table, columns)
    labels = [np.unique(columns[key]) for key in table.keys[1:]]
    axes = {TIME: table.times / 1e9, **dict(zip(table.keys[1:], labels, strict=True))}
    if math.prod(len(each) for each in axes.values()) > _MOST:
        raise RecordingError(
            f"`{table.name}` would fill {' x '.join(str(len(each)) for each in axes.values())} "
            "elements, most of them absent; take a data frame"
        )
    places = tuple(np.searchsorted(axes[key], columns[key]) for key in table.keys)
    variables = {}
    for name, parts in _arrays(columns, table.keys).items():
        lengths = [1 + max(place[n] for place in parts) for n in range(len(next(iter(parts))))]
        shape = (*(len(each) for each in axes.values()), *lengths)
        dims = (*axes, *(f"{name}_{n}" for n in range(len(lengths))))
        array = _filled(shape, places, parts)
        unit = table.units[next(column for column in columns if _split(column)[0] == name)]
        variables[name] = (dims, array, {"units": unit})
    coordinates = {key: (key, values, {"units": table.units[key]}) for key, values in axes.items()}
    return xarray.Dataset(variables, coordinates, {"recording": table.name})


def _of_records(xarray: ModuleType, table: TidyTable, columns: Mapping[str, Array]) -> Any:
    variables = {
        name: ("record", column, {"units": table.units[name]}) for name, column in columns.items()
    }
    return xarray.Dataset(variables, attrs={"recording": table.name})


def _one_table(recording: Recording, signals: Sequence[str]) -> TidyTable:
    """The table that has all of these signals.

    Raises:
        RecordingError: they are of several, or of none.
    """
    if not signals:
        raise RecordingError("name a signal, `component.connector`; * stands for any letters")
    found = tidy_tables(recording, chosen(recording, signals))
    if not found.tables:
        raise RecordingError("; ".join(found.left_out))
    if len(found.tables) > 1:
        told = "; ".join(f"{', '.join(each.signals)}" for each in found.tables)
        raise RecordingError(f"these are along different axes, so ask for each by itself: {told}")
    return found.tables[0]


def _read(table: TidyTable) -> dict[str, Array]:
    """All columns.

    Raises:
        RecordingError: some of it is lost.
    """
    lost = Lost.nothing()
    parts = list(table.blocks(lost))
    if lost.said:
        raise RecordingError("; ".join(lost.said))
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}


def _split(column: str) -> tuple[str, tuple[int, ...]]:
    """The signal and the indices that the name of a column says, `place[0, 1]`."""
    match = _ELEMENT.fullmatch(column)
    if match is None:
        return column, ()
    return match["name"], tuple(int(place) for place in match["places"].split(","))


def _arrays(
    columns: Mapping[str, Array], keys: Sequence[str]
) -> dict[str, dict[tuple[int, ...], Array]]:
    """The columns of each signal, by their indices."""
    found: dict[str, dict[tuple[int, ...], Array]] = {}
    for name, column in columns.items():
        if name not in keys:
            signal, place = _split(name)
            found.setdefault(signal, {})[place] = column
    return found


def _filled(
    shape: tuple[int, ...], places: tuple[Array, ...], parts: Mapping[tuple[int, ...], Array]
) -> Array:
    """An array with every number at its place; NaN, or nothing in texts, where there is none."""
    first = next(iter(parts.values()))
    is_whole = len(first) == math.prod(shape[: len(places)])
    if first.dtype == object:
        array = np.full(shape, "", object)
    elif is_whole or first.dtype.kind == "f":
        array = np.full(shape, np.nan if first.dtype.kind == "f" else 0, first.dtype)
    else:
        array = np.full(shape, np.nan)
    for place, column in parts.items():
        where: tuple[Any, ...] = (*places, *place)
        array[where] = column
    return array


def _native(column: Array) -> Array:
    """A column in this machine's byte order, which pandas insists on."""
    return column.astype(column.dtype.newbyteorder("="), copy=False)


def _module(name: str, what: str) -> ModuleType:
    try:
        return importlib.import_module(name)
    except ImportError:
        raise RecordingError(
            f"{what} needs `{name}`, which is not installed: pip install 'nlosim[{_EXTRA}]'"
        ) from None
