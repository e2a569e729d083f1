"""From the recording of a run to a file of recorded links, as `channel-trace` replays it."""

import importlib
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from decimal import Decimal
from pathlib import Path
from typing import Any, Final, TypeAlias

import numpy as np

from fmus.channel.stand_ins.table import PARQUET, parquet
from fmus.messages.records import FATES, LINKS, OUTCOMES, RECEPTION, TRANSMISSION, unframe
from orchestrator.recording import Recording, RecordingError
from orchestrator.signal import Array
from orchestrator.timebase import Duration, Time

Columns: TypeAlias = Mapping[str, Sequence[Any]]
"""Cells by the name of their column; `None` for an empty cell."""

_RECEIVED: Final = OUTCOMES.index("R")
_SENT: Final = FATES.index("sent")


@dataclass(frozen=True, slots=True, eq=False)
class Events:
    """What a run recorded of its channel.

    Attributes:
        receptions: RECEPTION records, by (handed, packet, hop, receiver), shape (reception,).
        handed: when the frame of each was handed to the transmitter's radio [ns], int64, shape
            (reception,).
        start: of the run [ns].
    """

    receptions: Array
    handed: Array
    start: Time

    @classmethod
    def of(cls, recording: Recording, channel: str, vehicles: Collection[int] = ()) -> "Events":
        """The events of the component called `channel`.

        Args:
            recording: of the run.
            channel: name of the component.
            vehicles: only links between these; empty for all.

        Raises:
            RecordingError: the recording lacks them, or another release wrote them.
        """
        receptions = _table(recording, f"{channel}.receptions", "RCPT", RECEPTION)
        sent = _table(recording, f"{channel}.transmissions", "SENT", TRANSMISSION)
        if vehicles:
            ends = (receptions["transmitter"], receptions["receiver"])
            receptions = receptions[np.logical_and(*(np.isin(e, list(vehicles)) for e in ends))]
        times = recording[f"{channel}.receptions"].times
        return cls.joined(receptions, sent, start=int(times[0]) if len(times) else 0)

    @classmethod
    def joined(cls, receptions: Array, transmissions: Array, *, start: Time) -> "Events":
        """The events with the time at which each frame was handed to its radio.

        Args:
            receptions: RECEPTION records, shape (reception,).
            transmissions: TRANSMISSION records, of all of their frames at least, shape
                (transmission,).
            start: of the run [ns].

        Raises:
            RecordingError: a frame was received that was not sent.
        """
        sent = transmissions[transmissions["fate"] == _SENT]
        keys = zip(sent["packet"].tolist(), sent["hop"].tolist(), strict=True)
        queued = dict(zip(keys, sent["queued"].tolist(), strict=True))
        frames = zip(receptions["packet"].tolist(), receptions["hop"].tolist(), strict=True)
        try:
            handed = np.array([queued[frame] for frame in frames], np.int64)
        except KeyError as error:
            packet, hop = error.args[0]
            raise RecordingError(
                f"hop {hop} of packet {packet} was received, but no transmission of it is recorded"
            ) from None
        order = np.lexsort([receptions[k] for k in ("receiver", "hop", "packet")] + [handed])
        return cls(receptions[order], handed[order], start)


def outcomes(events: Events, *, with_power: bool) -> Columns:
    """One row per reception, `time` when its frame was handed to the radio.

    Args:
        events: of the run.
        with_power: whether to tell powers, SNIR and link classes.
    """
    rows, handed = events.receptions, events.handed
    return {
        "time": _seconds(handed),
        "transmitter": rows["transmitter"].tolist(),
        "receiver": rows["receiver"].tolist(),
        "outcome": [OUTCOMES[code] for code in rows["outcome"]],
        "delay": _seconds(rows["time"] - handed),
        **(
            {
                "power_dbm": _known(rows["power_dbm"]),
                "snir_db": _known(rows["snir_db"]),
                "link": [LINKS[code] for code in rows["link"]],
            }
            if with_power
            else {}
        ),
    }


def error_rates(events: Events, bin_width: Duration, *, with_power: bool) -> Columns:
    """One row per link and bin in which frames were sent, `time` when the bin begins.

    Every outcome but R is an error. `power_dbm` is the mean of the received powers in mW,
    `link` the most frequent class.

    Args:
        events: of the run.
        bin_width: [ns].
        with_power: whether to tell power and link class; without, rows that do not change the
            error rate of their link are left out.
    """
    rows = events.receptions
    bins = (events.handed - events.start) // bin_width
    keys = np.stack([bins, rows["transmitter"], rows["receiver"]], axis=1)
    found, group = np.unique(keys, axis=0, return_inverse=True)
    group = group.reshape(-1)
    total = np.bincount(group, minlength=len(found))
    lost = np.bincount(group, rows["outcome"] != _RECEIVED, minlength=len(found))
    per = lost / np.maximum(total, 1)
    columns = {
        "time": _seconds(events.start + found[:, 0] * bin_width),
        "transmitter": found[:, 1].tolist(),
        "receiver": found[:, 2].tolist(),
        "per": [round(value, 6) for value in per.tolist()],
    }
    if not with_power:
        return _changes(columns)
    power = np.bincount(group, 10.0 ** (rows["power_dbm"] / 10.0), minlength=len(found))
    classes = np.stack(
        [
            np.bincount(group, rows["link"] == code, minlength=len(found))
            for code in range(len(LINKS))
        ]
    )
    return {
        **columns,
        "power_dbm": _known(np.round(10.0 * np.log10(power / np.maximum(total, 1)), 2)),
        "link": [LINKS[code] for code in classes.argmax(axis=0)],
    }


def write(columns: Columns, path: Path, remark: str) -> None:
    """Write a table; its type is told by its name.

    Args:
        columns: the table.
        path: `*.parquet` needs the extra `nlosim[parquet]`, all else is CSV.
        remark: one line of text, for the first line of a CSV file.

    Raises:
        ComponentTypeError: it is a Parquet file, and the extra is not installed.
        OSError: the file cannot be written.
    """
    if path.suffix == PARQUET:
        writer = parquet()  # says so if pyarrow is not installed
        numbers = {name: [_as_float(cell) for cell in cells] for name, cells in columns.items()}
        writer.write_table(importlib.import_module("pyarrow").table(numbers), path)
        return
    with path.open("w", encoding="utf-8", newline="\n") as file:
        file.write(f"# {remark}\n{','.join(columns)}\n")
        for cells in zip(*columns.values(), strict=True):
            file.write(",".join(map(_text, cells)) + "\n")


def _table(recording: Recording, name: str, magic: str, dtype: "np.dtype[Any]") -> Array:
    """All events of one signal."""
    try:
        tables = [unframe(magic, bytes(value), dtype) for value in recording[name]]
    except ValueError as error:
        raise RecordingError(f"`{name}`: {error}; another release recorded it") from None
    return np.concatenate([np.empty(0, dtype), *tables])


def _seconds(times: Array) -> list[Decimal]:
    """Exact seconds of nanoseconds."""
    return [Decimal(time).scaleb(-9).normalize() for time in times.tolist()]


def _text(cell: object) -> str:
    if isinstance(cell, Decimal):
        return f"{cell:f}"
    return "" if cell is None else str(cell)


def _as_float(cell: object) -> object:
    return float(cell) if isinstance(cell, Decimal) else cell


def _known(values: Array) -> list[float | None]:
    return [None if np.isnan(value) else value for value in values.tolist()]


def _changes(columns: Columns) -> Columns:
    """The rows, sorted by time, that change the error rate of their link."""
    last: dict[tuple[int, int], float] = {}
    changes = []
    for row, (transmitter, receiver, per) in enumerate(
        zip(columns["transmitter"], columns["receiver"], columns["per"], strict=True)
    ):
        if last.get((transmitter, receiver)) != per:
            changes.append(row)
            last[transmitter, receiver] = per
    return {name: [cells[row] for row in changes] for name, cells in columns.items()}
