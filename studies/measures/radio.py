"""The events on the radio channel in a recording, in batches."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Final, Literal, TypeAlias
from weakref import WeakKeyDictionary

import numpy as np

from fmus.messages.records import (
    APM,
    BSM,
    NOISE,
    OUTCOMES,
    RECEPTION,
    REQUEST,
    SENSOR_DATA,
    unframe,
)
from orchestrator.recording.reader import Recording
from orchestrator.signal import Array

Kind: TypeAlias = Literal["bsm", "apm", "sensor_data", "request", "any"]
"""Which messages count; `any`: all but noise."""

KINDS: Final = {"bsm": BSM, "apm": APM, "sensor_data": SENSOR_DATA, "request": REQUEST}
"""The number of each kind in records."""

RECEIVED: Final = OUTCOMES.index("R")
UNNOTICED: Final = OUTCOMES.index("U")

_BATCH: Final = 500_000
"""Records of a batch, or a few more."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Batch:
    """Some records, in order.

    Attributes:
        records: of the layout that was asked for, shape (record,).
        times: the communication points at which they were told [ns], shape (record,).
    """

    records: Array
    times: Array


def batches(
    recording: Recording, signal: str, magic: str, dtype: "np.dtype[Any]", kind: Kind = "any"
) -> Iterator[Batch]:
    """Read the records of a signal, at least one batch, which may be empty.

    Args:
        recording: of a run.
        signal: `component.connector`.
        magic: the four letters of its frames.
        dtype: the layout of its records.
        kind: of the messages that count.

    Raises:
        RecordingError: it was not recorded.
        ValueError: it has other records.
    """
    series = recording[signal]
    tables: list[Array] = []
    times: list[int] = []
    size = 0
    for k, time in enumerate(series.times.tolist()):
        table = unframe(magic, bytes(series[k]), dtype)
        tables.append(table)
        times.append(time)
        size += len(table)
        if size >= _BATCH:
            yield _batch(tables, times, dtype, kind)
            tables, times, size = [], [], 0
    yield _batch(tables, times, dtype, kind)


def _batch(
    tables: Sequence[Array], times: Sequence[int], dtype: "np.dtype[Any]", kind: Kind
) -> Batch:
    joined = np.concatenate([plain(table) for table in (np.empty(0, dtype), *tables)]).view(dtype)
    told = np.repeat(np.array(times, np.int64), [len(table) for table in tables])
    wanted = joined["kind"] != NOISE if kind == "any" else joined["kind"] == KINDS[kind]
    if wanted.all():
        return Batch(records=joined, times=told)
    return Batch(records=joined[wanted], times=told[wanted])


def table_of(
    recording: Recording, signal: str, magic: str, dtype: "np.dtype[Any]", kind: Kind = "any"
) -> Batch:
    """All records of a signal at once, see `batches`."""
    found = list(batches(recording, signal, magic, dtype, kind))
    return Batch(
        records=np.concatenate([each.records for each in found]),
        times=np.concatenate([each.times for each in found]),
    )


def received(recording: Recording, signal: str, kind: Kind) -> Batch:
    """All receptions with the outcome `R`.

    Several measures ask for them, so they are read once and kept as long as `recording` is.
    """
    known = _RECEIVED.setdefault(recording, {})
    if signal not in known:
        known[signal] = _received(recording, signal)
    every = known[signal]
    if kind == "any":
        return every
    wanted = every.records["kind"] == KINDS[kind]
    if wanted.all():
        return every
    return Batch(records=every.records[wanted], times=every.times[wanted])


_RECEIVED: Final[WeakKeyDictionary[Recording, dict[str, Batch]]] = WeakKeyDictionary()


def _received(recording: Recording, signal: str) -> Batch:
    found = []
    for batch in batches(recording, signal, "RCPT", RECEPTION):
        rows = np.flatnonzero(batch.records["outcome"] == RECEIVED)
        found.append((batch.records[rows], batch.times[rows]))
    records = np.concatenate([plain(records) for records, _ in found]).view(RECEPTION)
    times = np.concatenate([times for _, times in found])
    for array in (records, times):
        array.flags.writeable = False
    return Batch(records=records, times=times)


def plain(records: Array) -> Array:
    """Records without their fields, which NumPy would compare to join arrays, shape (record,)."""
    return np.asarray(records.view(np.dtype(f"V{records.dtype.itemsize}")))


def weak_recorded(recording: Recording, receptions: str) -> bool | None:
    """Whether frames below the sensitivity are among the receptions; `None` if nothing says it.

    The channel's parameter `weak_receptions` in the manifest says it; if there is none, an outcome
    `U` in the recording does.
    """
    name = receptions.partition(".")[0]
    component = recording.manifest.get("scenario", {}).get("components", {}).get(name, {})
    said = component.get("parameters", {}).get("weak_receptions")
    if isinstance(said, bool):
        return said
    for batch in batches(recording, receptions, "RCPT", RECEPTION):
        if (batch.records["outcome"] == UNNOTICED).any():
            return True
    return None
