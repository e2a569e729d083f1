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

_KEPT: Final = 1_000_000
"""Most receptions that are kept in memory; more are read again."""


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


@dataclass(frozen=True, slots=True)
class _Known:
    """What is known of receptions once they were read, without the recording that has them.

    Attributes:
        returning: see `Received`.
        kept: all of them, where they fit into memory.
    """

    returning: Array
    kept: Sequence[Batch] | None


class Received:
    """All receptions with the outcome `R`, batch by batch.

    Of a long run they do not fit into memory, so that they are read again whenever they are asked
    for; those of a short one are kept.

    Attributes:
        returning: numbers of the packets that were received in more than one batch, ascending,
            shape (packet,).
    """

    def __init__(self, recording: Recording, signal: str, known: _Known) -> None:
        self._recording, self._signal, self._known = recording, signal, known
        self.returning = known.returning

    def batches(self, kind: Kind) -> Iterator[Batch]:
        """Those of a kind; in no batch is one that came before one of an earlier batch."""
        kept = self._known.kept
        for batch in _read(self._recording, self._signal) if kept is None else kept:
            wanted = np.True_ if kind == "any" else batch.records["kind"] == KINDS[kind]
            if np.all(wanted):
                yield batch
            else:
                yield Batch(records=batch.records[wanted], times=batch.times[wanted])


def _looked_through(recording: Recording, signal: str) -> _Known:
    kept: list[Batch] | None = []
    numbers, latest, ascends, size = [np.empty(0, np.int64)], None, True, 0
    for batch in _read(recording, signal):
        times = batch.records["time"]
        numbers.append(np.unique(batch.records["packet"]))
        if len(times):
            ascends &= latest is None or int(times.min()) >= latest
            latest = int(times.max())
        size += len(times)
        if kept is not None:
            kept.append(batch)
        if size > _KEPT and ascends:
            kept = None
    found, counts = np.unique(np.concatenate(numbers), return_counts=True)
    if not ascends:
        kept = [_in_order(list(_read(recording, signal)))]
    return _Known(found[counts > 1], kept)


def _read(recording: Recording, signal: str) -> Iterator[Batch]:
    for batch in batches(recording, signal, "RCPT", RECEPTION):
        rows = np.flatnonzero(batch.records["outcome"] == RECEIVED)
        records, times = batch.records[rows], batch.times[rows]
        for array in (records, times):
            array.flags.writeable = False
        yield Batch(records=records, times=times)


def _in_order(found: Sequence[Batch]) -> Batch:
    """All of them in one, by their times."""
    records = np.concatenate([plain(each.records) for each in found]).view(RECEPTION)
    order = np.argsort(records["time"], kind="stable")
    times = np.concatenate([each.times for each in found])
    return Batch(records=records[order], times=times[order])


def received(recording: Recording, signal: str) -> Received:
    """All receptions with the outcome `R`.

    Several measures ask for them, so what is known of them is kept as long as `recording` is.
    """
    known = _KNOWN.setdefault(recording, {})
    if signal not in known:
        known[signal] = _looked_through(recording, signal)
    return Received(recording, signal, known[signal])


_KNOWN: Final[WeakKeyDictionary[Recording, dict[str, _Known]]] = WeakKeyDictionary()
"""What is known of each recording as long as somebody has it; nothing in here may hold one."""


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
