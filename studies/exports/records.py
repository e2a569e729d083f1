"""Signals of records as tables: a row for each packet, reception, transmission and object."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, Final

import numpy as np

from fmus.messages.records import (
    APM,
    BSM,
    FATES,
    LINKS,
    NOISE,
    OBJECT,
    OBJECTS_MIME,
    PACKET,
    PACKETS_MIME,
    RECEPTION,
    RECEPTIONS_MIME,
    REQUEST,
    SENSOR_DATA,
    TRANSMISSION,
    TRANSMISSIONS_MIME,
    unframe,
)
from orchestrator.recording.layout import RecordingError
from orchestrator.recording.reader import Series
from orchestrator.recording.tidy import TIME, Decoder, Lost, TidyTable, spans
from orchestrator.signal import Array
from orchestrator.table_files import Table

_SECOND: Final = 1e9
KINDS: Final = {
    BSM: "bsm",
    APM: "apm",
    SENSOR_DATA: "sensor_data",
    REQUEST: "request",
    NOISE: "noise",
}
"""What the numbers in `kind` mean."""

_OUTCOMES: Final = dict(
    enumerate(("received", "noise", "collision", "busy", "sending", "unnoticed"))
)
_CATEGORIES: Final = dict(enumerate(("background", "best effort", "video", "voice")))


@dataclass(frozen=True, slots=True, kw_only=True)
class _Column:
    """A column of a table of records.

    Attributes:
        field: of the records.
        unit: of the column; `s` of a field in nanoseconds.
        names: of the numbers of the field; none: the numbers themselves.
    """

    field: str
    unit: str = "1"
    names: Mapping[int, str] | None = None

    def read(self, records: Array) -> Array:
        values = records[self.field]
        if self.names is not None:
            known = np.array([self.names.get(k, str(k)) for k in range(256)])
            return np.asarray(known[values])
        if self.unit == "s" and values.dtype.kind == "i":
            return np.asarray(values / _SECOND)
        return np.ascontiguousarray(values)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Layout:
    """How a signal of records becomes a table.

    Attributes:
        magic: the four letters of its frames.
        dtype: of a record.
        columns: by their names.
    """

    magic: str
    dtype: "np.dtype[Any]"
    columns: Mapping[str, _Column]

    def columns_of(self, records: Array) -> dict[str, Array]:
        """The columns of records, shape (record,) each; those of a field of several have `[k]`."""
        table: dict[str, Array] = {}
        for name, column in self.columns.items():
            values = column.read(records)
            if values.ndim == 1:
                table[name] = values
            else:
                table.update({f"{name}[{k}]": values[:, k] for k in range(values.shape[1])})
        return table

    @property
    def units(self) -> dict[str, str]:
        """The units of all columns."""
        none = self.columns_of(np.empty(0, self.dtype))
        return {name: self.columns[name.partition("[")[0]].unit for name in none}


_WHAT: Final = {"kind": _Column(field="kind", names=KINDS)}

PACKETS: Final = _Layout(
    magic="PKTS",
    dtype=PACKET,
    columns={
        "packet": _Column(field="id"),
        "handed_over": _Column(field="time", unit="s"),
        "source": _Column(field="source"),
        "destination": _Column(field="destination"),
        "route": _Column(field="route"),
        "duration": _Column(field="duration", unit="s"),
        "power_offset": _Column(field="power_offset", unit="dB"),
        "size": _Column(field="size", unit="byte"),
        "access_category": _Column(field="access_category", names=_CATEGORIES),
        **_WHAT,
        "channel_offset": _Column(field="channel_offset"),
    },
)
RECEPTIONS: Final = _Layout(
    magic="RCPT",
    dtype=RECEPTION,
    columns={
        "packet": _Column(field="packet"),
        "end": _Column(field="time", unit="s"),
        "transmitter": _Column(field="transmitter"),
        "receiver": _Column(field="receiver"),
        "power": _Column(field="power_dbm", unit="dBm"),
        "snir": _Column(field="snir_db", unit="dB"),
        "hop": _Column(field="hop"),
        "outcome": _Column(field="outcome", names=_OUTCOMES),
        "link": _Column(field="link", names=dict(enumerate(LINKS))),
        **_WHAT,
        "addressed": _Column(field="addressed"),
    },
)
TRANSMISSIONS: Final = _Layout(
    magic="SENT",
    dtype=TRANSMISSION,
    columns={
        "packet": _Column(field="packet"),
        "start": _Column(field="time", unit="s"),
        "queued": _Column(field="queued", unit="s"),
        "transmitter": _Column(field="transmitter"),
        "duration": _Column(field="duration", unit="s"),
        "hop": _Column(field="hop"),
        "fate": _Column(field="fate", names=dict(enumerate(FATES))),
        "access_category": _Column(field="access_category", names=_CATEGORIES),
        **_WHAT,
    },
)
OBJECTS: Final = _Layout(
    magic="OBJS",
    dtype=OBJECT,
    columns={
        "sensor": _Column(field="sensor"),
        "scanned": _Column(field="time", unit="s"),
        "track": _Column(field="instance"),
        "points": _Column(field="points"),
        "position": _Column(field="position", unit="m"),
        "angle": _Column(field="angle", unit="rad"),
        "size": _Column(field="size", unit="m"),
        "height": _Column(field="height", unit="m"),
        "velocity": _Column(field="velocity", unit="m/s"),
    },
)


def table_of(layout: _Layout) -> Decoder:
    """Makes tables of signals with records of a layout."""

    def decode(series: Series) -> TidyTable:
        return TidyTable(
            name=series.name,
            signals=(series.name,),
            keys=(TIME,),
            units={TIME: "s", **layout.units},
            times=series.times,
            _read=partial(_blocks, layout, series),
        )

    return decode


def _blocks(layout: _Layout, series: Series, lost: Lost) -> Iterator[Table]:
    yield _table(layout, [], [])
    for first, end in spans(series.lengths // layout.dtype.itemsize):
        frames, times = [], []
        for k in range(first, end):
            time = int(series.times[k])
            try:
                frames.append(unframe(layout.magic, bytes(series[k]), layout.dtype))
                times.append(time)
            except RecordingError as error:
                lost.note(series.name, time, error)
            except ValueError as error:
                lost.note(series.name, time, RecordingError(str(error)))
        yield _table(layout, frames, times)


def _table(layout: _Layout, frames: Sequence[Array], times: Sequence[int]) -> Table:
    records = np.concatenate([np.empty(0, layout.dtype), *frames])
    told = np.repeat(np.array(times, np.int64), [len(frame) for frame in frames])
    return {TIME: told / _SECOND, **layout.columns_of(records)}


DECODERS: Final[Mapping[str, Decoder]] = {
    PACKETS_MIME: table_of(PACKETS),
    RECEPTIONS_MIME: table_of(RECEPTIONS),
    TRANSMISSIONS_MIME: table_of(TRANSMISSIONS),
    OBJECTS_MIME: table_of(OBJECTS),
}
"""What makes tables, by MIME type."""
