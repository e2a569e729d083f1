"""What vehicles have received of each other, at instants of a run."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from orchestrator.recording.reader import Recording
from orchestrator.signal import Array
from studies.measures.delivery import sent_as, unique_packets
from studies.measures.links import UNKNOWN, Links, lengthened, link
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
    newest.finish()


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
        self._sent = sent if kind == "any" else sent[sent["kind"] == KINDS[kind]]
        self._receptions = receptions
        self._batches = received(recording, receptions).batches(kind)
        self._links = Links()
        self._generated = self._heard = np.empty(0, np.int64)
        self._rows = self._times = self._made = np.empty(0, np.int64)  # of the batch
        self._done = 0  # of it

    def advance(self, time: int) -> None:
        """Take into account what was received up to and at `time` [ns]."""
        while True:
            end = int(np.searchsorted(self._times, time, side="right"))
            new = slice(self._done, end)
            np.maximum.at(self._generated, self._rows[new], self._made[new])
            np.maximum.at(self._heard, self._rows[new], self._times[new])
            self._done = end
            if end < len(self._times) or not self._next():
                return

    def finish(self) -> None:
        """Look at what was received since, too: whether it was sent."""
        while self._next():
            pass

    def _next(self) -> bool:
        """Take the next batch; whether there is one."""
        batch = next(self._batches, None)
        if batch is None:
            return False
        order = np.argsort(batch.records["time"], kind="stable")
        rows = batch.records[order]
        packet = sent_as(self._sent, rows["packet"], self._receptions)
        self._rows = self._links.meet(link(rows["receiver"], self._sent["source"][packet]))
        self._generated = lengthened(self._generated, len(self._links), NEVER)
        self._heard = lengthened(self._heard, len(self._links), NEVER)
        self._times, self._made, self._done = rows["time"], self._sent["time"][packet], 0
        return True

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
        rows = self._links.rows(link(receiver, source))
        is_known = rows != UNKNOWN
        return (
            np.where(is_known, self._generated[rows], never),
            np.where(is_known, self._heard[rows], never),
        )
