"""What road users come to know of each other, from which source and when."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from fmus.messages.records import OBJECT, unframe
from fmus.physics.boxes import in_boxes
from orchestrator.recording.reader import Recording
from orchestrator.signal import Array
from studies.measures.delivery import unique_packets
from studies.measures.links import UNKNOWN, Links, link
from studies.measures.radio import KINDS, Kind, plain, received
from studies.measures.sight import Bodies

NEVER: Final = -1
"""Stands for the time of what does not happen."""

MARGIN: Final = 0.5
"""How far the middle of an object may lie beside the body that it is [m]; what a vehicle moves
between a scan and the communication point that it is compared with."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Windows:
    """From when until when it matters what an observer learns of a road user.

    Attributes:
        links: from observers to road users.
        since: of each link [ns], shape (link,).
        until: of each link [ns], shape (link,).
    """

    links: Links
    since: Array
    until: Array


class Knowledge:
    """When observers learned of road users, from one source.

    Args:
        links: from observers to road users.
        rows: the link of each time, shape (n,).
        times: when [ns], shape (n,).
    """

    def __init__(self, links: Links, rows: Sequence[Array], times: Sequence[Array]) -> None:
        self._links = links
        self._span = max((int(each.max()) for each in times if len(each)), default=-1) + 2
        parts = [
            row.astype(np.int64) * self._span + time for row, time in zip(rows, times, strict=True)
        ]
        self._when = np.concatenate([np.empty(0, np.int64), *parts])
        self._when.sort()

    @classmethod
    def of(cls, observer: Array, road_user: Array, time: Array) -> "Knowledge":
        """That of numbers of observers and road users, and times [ns], shape (n,) each."""
        links = Links()
        return cls(links, [links.meet(link(observer, road_user))], [time])

    def latest(self, observer: Array, road_user: Array, time: Array) -> Array:
        """The last time at or before each `time` [ns], or `NEVER`, shape (n,)."""
        return self._at(observer, road_user, time, -1)

    def next(self, observer: Array, road_user: Array, time: Array) -> Array:
        """The first time after each `time` [ns], or `NEVER`, shape (n,)."""
        return self._at(observer, road_user, time, 0)

    def _at(self, observer: Array, road_user: Array, time: Array, step: int) -> Array:
        never = np.full(len(time), NEVER, np.int64)
        if len(self._when) == 0:
            return never
        row = self._links.rows(link(observer, road_user))
        newest = np.minimum(time, self._span - 1)
        place = np.searchsorted(self._when, row * self._span + newest, side="right") + step
        is_inside = (row != UNKNOWN) & (place >= 0) & (place < len(self._when))
        owner, when = np.divmod(self._when[np.clip(place, 0, len(self._when) - 1)], self._span)
        return np.where(is_inside & (owner == row), when, never)


def from_messages(
    recording: Recording, packets: str, receptions: str, kind: Kind, windows: Windows
) -> Knowledge:
    """What those know who received messages of a kind: of their sources.

    Args:
        recording: of a run.
        packets: `component.connector`.
        receptions: likewise.
        kind: of the messages.
        windows: what is asked for; the rest is left out.

    Raises:
        RecordingError: a signal was not recorded.
    """
    sent = unique_packets(recording, packets)
    sent = sent if kind == "any" else sent[sent["kind"] == KINDS[kind]]
    found: list[Array] = []
    times: list[Array] = []
    for batch in received(recording, receptions).batches(kind) if len(sent) else ():
        time = batch.records["time"]
        packet = np.minimum(np.searchsorted(sent["id"], batch.records["packet"]), len(sent) - 1)
        is_known = sent["id"][packet] == batch.records["packet"]
        rows = windows.links.rows(link(batch.records["receiver"], sent["source"][packet]))
        counts = np.flatnonzero(is_known & (rows != UNKNOWN))
        rows, time = rows[counts], time[counts]
        counts = np.flatnonzero((time >= windows.since[rows]) & (time <= windows.until[rows]))
        found.append(rows[counts].astype(np.int32))
        times.append(time[counts])
    return Knowledge(windows.links, found, times)


def from_sensors(recording: Recording, objects: str, bodies: Bodies) -> Knowledge:
    """What those know who carry sensors: of whom their objects are.

    Args:
        recording: of a run.
        objects: `component.connector`, of objects.
        bodies: of all road users.

    Raises:
        RecordingError: the signal was not recorded.
    """
    table, told = _objects(recording, objects)
    return _known(table["sensor"], _owners(table, bodies), told)


def from_others(recording: Recording, received_objects: str, ego: str, bodies: Bodies) -> Knowledge:
    """What an ego vehicle knows of the objects that others sent to it.

    Args:
        recording: of a run.
        received_objects: `component.connector`, of objects.
        ego: the signal of its number.
        bodies: of all road users.

    Raises:
        RecordingError: a signal was not recorded.
    """
    table, told = _objects(recording, received_objects)
    series = recording[ego]
    newest = np.searchsorted(series.times, told, side="right") - 1
    number = np.asarray(series.values).reshape(len(series))[np.maximum(newest, 0)]
    return _known(np.where(newest >= 0, number, NEVER), _owners(table, bodies), told)


def _known(observer: Array, road_user: Array, time: Array) -> Knowledge:
    counts = (road_user != NEVER) & (observer != NEVER)
    return Knowledge.of(observer[counts], road_user[counts], time[counts])


def _objects(recording: Recording, name: str) -> tuple[Array, Array]:
    """All objects, each of a scan once, and when they were first told [ns], shape (object,)."""
    series = recording[name]
    parts, times = [plain(np.empty(0, OBJECT))], [np.empty(0, np.int64)]
    former = b""
    for k, time in enumerate(series.times.tolist()):
        data = bytes(series[k])
        if data != former:  # a signal is held until there is something new
            table = unframe("OBJS", data, OBJECT)
            parts.append(plain(table))
            times.append(np.full(len(table), time))
        former = data
    table, told = np.concatenate(parts).view(OBJECT), np.concatenate(times)
    keys = np.stack([table["sensor"], table["time"], table["instance"]])
    _, first = np.unique(keys, axis=1, return_index=True)
    return table[first], told[first]


def _owners(table: Array, bodies: Bodies) -> Array:
    """The road user in whose body the middle of each object lies, or `NEVER`, shape (object,)."""
    points = bodies.vehicles.at(table["time"])
    found = np.full(len(table), NEVER, np.int64)
    for rows, present in _scenes(points, bodies):
        middle = table["position"][rows]
        place = bodies.vehicles.position[present, :2]
        offset = np.abs(in_boxes(middle[:, None], place, bodies.heading[present]))
        outside = (offset - bodies.size[present, :2] / 2).max(axis=2)  # negative inside
        nearest = np.argmin(outside, axis=1)
        is_near = outside[np.arange(len(rows)), nearest] <= MARGIN
        found[rows] = np.where(is_near, bodies.vehicles.ids[present][nearest], NEVER)
    return found


def _scenes(points: Array, bodies: Bodies) -> Iterator[tuple[Array, slice]]:
    """The objects of each communication point, with the rows of those who were there."""
    order = np.argsort(points, kind="stable")
    known, starts = np.unique(points[order], return_index=True)
    first = bodies.vehicles.first
    ends = np.append(starts[1:], len(order))
    for point, start, end in zip(known.tolist(), starts, ends[: len(starts)], strict=True):
        if point >= 0 and first[point + 1] > first[point]:
            yield order[start:end], slice(int(first[point]), int(first[point + 1]))
