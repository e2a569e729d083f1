"""All road users at one time, as a file says, checked cell by cell."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from decimal import Decimal, InvalidOperation
from typing import Any, Final, TypeAlias

import numpy as np

from adapters.replay.findings import Findings, Place
from adapters.traffic.geometry import Float
from orchestrator.timebase import NANOSECONDS_PER_SECOND, Time

Cell: TypeAlias = Any
"""Text, or a number in Parquet files; `None` where nothing is written."""

MOTION: Final = ("x", "y", "heading", "speed")
SIZE: Final = ("length", "width", "height")

_LATEST: Final = 4e9
"""Seconds: 2^63 ns is a little more than twice as much."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Snapshot:
    """What a file says about one time; units and reference point are those of the file.

    Attributes:
        time: of the file [ns].
        names: the file's ids.
        keys: what tells road users apart; a vehicle and a person may share a name.
        types: their names.
        motion: x, y, heading and speed, shape (sample, 4).
        size: length, width and height, NaN where the file is silent, shape (sample, 3).
        places: where each road user is written.
        place: where the time is written.
    """

    time: Time
    names: Sequence[str]
    keys: Sequence[str]
    types: Sequence[str]
    motion: Float
    size: Float
    places: Sequence[Place]
    place: Place


def file_time(cell: Cell) -> Time | None:
    """Seconds to the nearest nanosecond; `None` if `cell` is no time."""
    try:
        exact = Decimal(str(cell).strip())
    except InvalidOperation:
        return None
    if not exact.is_finite() or abs(exact) > _LATEST:
        return None
    return round(exact * NANOSECONDS_PER_SECOND)


def read_snapshot(
    time: Time,
    cells: Mapping[str, Sequence[Cell]],
    places: Sequence[Place],
    findings: Findings,
    *,
    place: Place,
    labels: Mapping[str, str],
) -> Snapshot:
    """Check the cells of one time; what is wrong is noted and makes the snapshot useless.

    Args:
        time: of the file [ns].
        cells: by column: id, type, those of `MOTION`, and any of `SIZE`; `key` where it is another
            than the id.
        places: where each row is written.
        findings: takes what is wrong.
        place: where the time is written.
        labels: what a column is called in the file, if otherwise.
    """
    count = len(places)
    names = _texts("id", cells, places, findings)
    keys = cells.get("key", names)
    types = _texts("type", cells, places, findings)
    for key, times in Counter(keys).items():
        second = [row for row, other in enumerate(keys) if other == key][1] if times > 1 else 0
        if times > 1 and names[second]:
            what = f"`{names[second]}` is there {times} times at the same time"
            findings.note(places[second], what)
    motion, size = np.empty((count, len(MOTION))), np.full((count, len(SIZE)), np.nan)
    for k, column in enumerate(MOTION):
        label = labels.get(column, column)
        motion[:, k] = _numbers(label, cells[column], places, findings)
    for k, column in enumerate(SIZE):
        if column in cells:
            size[:, k] = _sizes(column, cells[column], places, findings)
    return Snapshot(
        time=time,
        names=names,
        keys=keys,
        types=types,
        motion=motion,
        size=size,
        places=places,
        place=place,
    )


def _texts(
    column: str,
    cells: Mapping[str, Sequence[Cell]],
    places: Sequence[Place],
    findings: Findings,
) -> list[str]:
    texts = ["" if cell is None else str(cell) for cell in cells[column]]
    if not all(texts):
        for row, text in enumerate(texts):
            if not text:
                findings.note(places[row], f"`{column}` is missing")
    return texts


def _numbers(
    label: str, cells: Sequence[Cell], places: Sequence[Place], findings: Findings
) -> Float:
    values = _floats(cells)
    for row in np.flatnonzero(~np.isfinite(values)).tolist():
        findings.note(places[row], f"`{label}` {_wrong(cells[row])}, a finite number is needed")
    return values


def _sizes(
    column: str, cells: Sequence[Cell], places: Sequence[Place], findings: Findings
) -> Float:
    """Numbers, NaN where nothing is written."""
    values = _floats(cells)
    is_wrong = np.array([cell is not None for cell in cells])
    is_wrong &= ~((values > 0.0) & np.isfinite(values))
    for row in np.flatnonzero(is_wrong).tolist():
        what = f"`{column}` {_wrong(cells[row])}, a positive number of metres is needed"
        findings.note(places[row], what)
    return values


def _floats(cells: Sequence[Cell]) -> Float:
    """NaN where there is no number."""
    try:
        return np.array([float(cell) for cell in cells])
    except (TypeError, ValueError):
        return np.array([_float(cell) for cell in cells])


def _float(cell: Cell) -> float:
    try:
        return float(cell)
    except (TypeError, ValueError):
        return float("nan")


def _wrong(cell: Cell) -> str:
    return "is missing" if cell is None else f"is `{cell}`"
