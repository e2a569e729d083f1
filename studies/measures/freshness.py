"""What vehicles have received of each other, at instants of a run."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from orchestrator.recording.reader import Recording
from orchestrator.signal import Array
from studies.measures.delivery import unique_packets
from studies.measures.radio import KINDS, Kind, received
from studies.measures.vehicles import Vehicles, near_pairs, plane_distance

NEVER: Final = -1
"""Stands for the time of what has not happened."""

_GOLDEN: Final = (5**0.5 - 1) / 2


@dataclass(frozen=True, slots=True, kw_only=True)
class Neighbours:
    """What vehicles with radios have of each neighbour with one, at one instant.

    Attributes:
        time: the instant [ns].
        distance: to the neighbour, in the plane [m], shape (n,).
        generated: when the newest information of it was handed to its radio [ns], or `NEVER`, shape
            (n,).
        heard: when information of it was last received [ns], or `NEVER`, shape (n,).
    """

    time: int
    distance: Array
    generated: Array
    heard: Array


def neighbours_at(
    recording: Recording,
    vehicles: Vehicles,
    has_radio: Array,
    instants: Array,
    *,
    packets: str,
    receptions: str,
    kind: Kind,
    radius: float,
) -> Iterator[Neighbours]:
    """Who knows what of whom, at every instant.

    Information is of the source of a packet, whoever transmitted the frame that brought it.

    Args:
        recording: of a run.
        vehicles: all of them.
        has_radio: of every row of `vehicles`, shape (row,).
        instants: ascending [ns], none before the first point of `vehicles`, shape (instant,).
        packets: signal of the packets that were sent.
        receptions: signal of the receptions.
        kind: of the messages that count.
        radius: distance up to which vehicles are neighbours [m].
    """
    newest = _Newest(recording, packets, receptions, kind)
    points = vehicles.at(instants)
    for time, point in zip(instants.tolist(), points.tolist(), strict=True):
        newest.advance(time)
        present = np.arange(vehicles.first[point], vehicles.first[point + 1])
        a, b = near_pairs(vehicles, present[has_radio[present]], radius)
        receiver, source = np.concatenate([a, b]), np.concatenate([b, a])
        generated, heard = newest.of(vehicles.ids[receiver], vehicles.ids[source])
        yield Neighbours(
            time=time,
            distance=plane_distance(vehicles, receiver, source),
            generated=generated,
            heard=heard,
        )


def instants_between(times: Sequence[int] | Array, interval: float) -> Array:
    """Instants to look at, one in each `interval` [s] from the first to the last of `times` [ns].

    Within its interval each is elsewhere (multiples of the golden ratio, modulo 1), so that they
    are in step with nothing that is periodic; int64 [ns], shape (instant,).
    """
    start, end, width = int(times[0]), int(times[-1]), interval * 1e9
    k = np.arange(int((end - start) // width))
    return np.asarray(start + np.floor((k + (k + 1) * _GOLDEN % 1.0) * width), np.int64)


class _Newest:
    """The newest of what was received over every link, up to a time that advances."""

    def __init__(self, recording: Recording, packets: str, receptions: str, kind: Kind) -> None:
        sent = unique_packets(recording, packets)
        sent = sent if kind == "any" else sent[sent["kind"] == KINDS[kind]]
        rows = received(recording, receptions, kind).records
        packet = np.searchsorted(sent["id"], rows["packet"])
        packet[packet == len(sent)] = 0
        is_known = sent["id"][packet] == rows["packet"] if len(sent) else np.zeros(len(rows), bool)
        if not is_known.all():
            unknown = rows["packet"][~is_known][0]
            raise ValueError(f"`{receptions}` has packet {unknown}, which nobody sent")
        order = np.argsort(rows["time"], kind="stable")
        link = _link(rows["receiver"], sent["source"][packet])[order]
        self._links, self._rank = np.unique(link, return_inverse=True)
        self._times, self._made = rows["time"][order], sent["time"][packet][order]
        self._generated = np.full(len(self._links), NEVER, np.int64)
        self._heard = np.full(len(self._links), NEVER, np.int64)
        self._done = 0

    def advance(self, time: int) -> None:
        """Take into account what was received up to and at `time` [ns]."""
        end = int(np.searchsorted(self._times, time, side="right"))
        new = slice(self._done, end)
        np.maximum.at(self._generated, self._rank[new], self._made[new])
        np.maximum.at(self._heard, self._rank[new], self._times[new])
        self._done = end

    def of(self, receiver: Array, source: Array) -> tuple[Array, Array]:
        """What receivers have of sources, `NEVER` if nothing.

        Args:
            receiver: numbers of vehicles, shape (n,).
            source: likewise.

        Returns:
            When the newest was handed over, and when it was received last [ns], shape (n,) each.
        """
        never = np.full(len(receiver), NEVER, np.int64)
        if len(self._links) == 0:
            return never, never
        wanted = _link(receiver, source)
        rank = np.searchsorted(self._links, wanted)
        rank[rank == len(self._links)] = 0
        is_known = self._links[rank] == wanted
        return (
            np.where(is_known, self._generated[rank], never),
            np.where(is_known, self._heard[rank], never),
        )


def _link(receiver: Array, source: Array) -> Array:
    """One number for a receiver and a source; vehicles are below 2^31."""
    return np.asarray((np.asarray(receiver, np.int64) << 32) + source)
