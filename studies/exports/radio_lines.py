"""Links and messages as lines between road users, for viewers that draw no radio."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np

from fmus.messages.records import (
    LINKS,
    NO_VEHICLE,
    OUTCOMES,
    PACKET,
    PACKETS_MIME,
    RECEPTION,
    RECEPTIONS_MIME,
    unframe,
)
from orchestrator.recording.layout import RecordingError
from orchestrator.recording.reader import Recording, Series
from orchestrator.recording.tidy import Lost
from orchestrator.signal import Array
from studies.exports.records import KINDS
from studies.exports.scene import binary_signals
from studies.exports.tracks import Tracks

WINDOW: Final = 100_000_000
"""Lines are those of frames that came within so long before [ns]: a BSM of each comes once."""

_ABOVE: Final = 1.5
"""Height of lines above the ground [m]."""

_RECEIVED: Final = OUTCOMES.index("R")
_UNNOTICED: Final = OUTCOMES.index("U")
_LOST: Final = "lost"


@dataclass(frozen=True, slots=True, kw_only=True)
class Lines:
    """Lines of one sort over time.

    Attributes:
        name: `links/LOS` and the other classes, `links/lost`; `messages/KIND`, `messages/lost`.
        times: of the windows that have some, or have none any more [ns], int64, shape (window,).
        counts: of lines in each, int64, shape (window,).
        ends: from the transmitter to the receiver, where they were when the frame came [m], shape
            (line, 2, 3).
    """

    name: str
    times: Array
    counts: Array
    ends: Array


def lines_of(recording: Recording, tracks: Tracks, lost: Lost) -> tuple[list[Lines], list[str]]:
    """The links to driven entities and the messages to one receiver, and what is left out.

    Args:
        recording: of a run.
        tracks: of its road users.
        lost: takes what cannot be read.

    Returns:
        Lines by sort, shape (line, 2, 3) [m]; sentences of what is left out.
    """
    signals = binary_signals(recording, RECEPTIONS_MIME)
    if not signals:
        return [], []
    left_out = []
    driven = np.unique(tracks.ids[tracks.is_driven])
    if not len(driven):
        left_out.append("no links are drawn: they are those to driven entities, and there are none")
    addressed = _addressed(recording, lost)
    frames = _frames(recording, signals, lambda record: _wanted(record, driven, addressed), lost)
    window = -(-frames["time"] // WINDOW)
    sample = np.searchsorted(tracks.times, frames["time"], side="right") - 1
    ends, is_there = [], np.ones(len(frames), bool)
    for end in ("transmitter", "receiver"):
        places, are_there = tracks.places(sample, frames[end])
        ends.append(places + np.array([0.0, 0.0, _ABOVE]))
        is_there &= are_there
    lines = np.stack(ends, axis=1)
    found = []
    for name, those in _sorts(frames, driven, addressed).items():
        rows = np.flatnonzero(those & is_there)
        if len(rows):
            found.append(_over_time(name, window[rows], lines[rows]))
    return found, left_out


def _wanted(records: Array, driven: Array, addressed: Array) -> Array:
    to_driven = np.isin(records["receiver"], driven) & (records["outcome"] != _UNNOTICED)
    return np.asarray(to_driven | _is_to_one(records, addressed))


def _is_to_one(records: Array, addressed: Array) -> Array:
    """Whether each is a hop of a packet to one receiver, at who has to receive it."""
    return np.asarray((records["addressed"] == 1) & np.isin(records["packet"], addressed))


def _sorts(frames: Array, driven: Array, addressed: Array) -> dict[str, Array]:
    """Which frames are drawn as what, bool, shape (frame,) each."""
    came = frames["outcome"] == _RECEIVED
    to_driven = np.isin(frames["receiver"], driven)
    to_one = _is_to_one(frames, addressed)
    sorts = {
        f"links/{link}": to_driven & came & (frames["link"] == code)
        for code, link in enumerate(LINKS)
    }
    sorts[f"links/{_LOST}"] = to_driven & ~came & (frames["outcome"] != _UNNOTICED)
    for code, kind in KINDS.items():
        sorts[f"messages/{kind}"] = to_one & came & (frames["kind"] == code)
    sorts[f"messages/{_LOST}"] = to_one & ~came
    return sorts


def _over_time(name: str, window: Array, lines: Array) -> Lines:
    """Lines by window; after one that has some comes one that has none, if no other does."""
    order = np.argsort(window, kind="stable")
    numbers, counts = np.unique(window, return_counts=True)
    empty = np.setdiff1d(numbers + 1, numbers)
    windows = np.concatenate([numbers, empty])
    every = np.concatenate([counts, np.zeros(len(empty), np.int64)])
    place = np.argsort(windows)
    return Lines(name=name, times=windows[place] * WINDOW, counts=every[place], ends=lines[order])


def _addressed(recording: Recording, lost: Lost) -> Array:
    """The packets to one receiver, int64."""
    parts = [
        records["id"][records["destination"] != NO_VEHICLE]
        for name in binary_signals(recording, PACKETS_MIME)
        for records in _read(recording[name], "PKTS", PACKET, lost)
    ]
    return np.unique(np.concatenate([np.empty(0, np.int64), *parts]))


def _frames(
    recording: Recording, signals: list[str], wanted: Callable[[Array], Array], lost: Lost
) -> Array:
    """The receptions that are wanted, shape (frame,)."""
    parts = [
        records[wanted(records)]
        for name in signals
        for records in _read(recording[name], "RCPT", RECEPTION, lost)
    ]
    return np.concatenate([np.empty(0, RECEPTION), *parts])


def _read(series: Series, magic: str, dtype: "np.dtype[np.void]", lost: Lost) -> Iterator[Array]:
    for k, time in enumerate(series.times.tolist()):
        try:
            yield unframe(magic, bytes(series[k]), dtype)
        except RecordingError as error:
            lost.note(series.name, time, error)
        except ValueError as error:
            lost.note(series.name, time, RecordingError(str(error)))
