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
        instants: ascending [ns], shape (instant,).
        packets: signal of the packets that were sent.
        receptions: signal of the receptions.
        kind: of the messages that count.
        radius: distance up to which vehicles are neighbours [m].
    """
    newest = _Newest.of(recording, packets, receptions, kind, instants)
    points = vehicles.at(instants)
    for k, point in enumerate(points.tolist()):
        if point < 0:
            continue
        present = np.arange(vehicles.first[point], vehicles.first[point + 1])
        a, b = near_pairs(vehicles, present[has_radio[present]], radius)
        receiver, source = np.concatenate([a, b]), np.concatenate([b, a])
        generated, heard = newest.at(k, vehicles.ids[receiver], vehicles.ids[source])
        yield Neighbours(
            time=int(instants[k]),
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


@dataclass(frozen=True, slots=True, kw_only=True)
class _Newest:
    """The newest of what was received over every link, by link and time.

    Attributes:
        keys: a number for link and instant from which on a reception counts, ascending.
        links: a number for receiver and source, ascending, shape (link,).
        stride: from the keys of a link to those of the next one.
        generated: when the newest information so far was handed over [ns].
        heard: when it was received [ns].
    """

    keys: Array
    links: Array
    stride: int
    generated: Array
    heard: Array

    @classmethod
    def of(
        cls, recording: Recording, packets: str, receptions: str, kind: Kind, instants: Array
    ) -> "_Newest":
        sent = unique_packets(recording, packets)
        sent = sent if kind == "any" else sent[sent["kind"] == KINDS[kind]]
        rows = received(recording, receptions, kind).records
        packet = np.searchsorted(sent["id"], rows["packet"])
        packet[packet == len(sent)] = 0
        is_known = sent["id"][packet] == rows["packet"] if len(sent) else np.zeros(len(rows), bool)
        if not is_known.all():
            unknown = rows["packet"][~is_known][0]
            raise ValueError(f"`{receptions}` has packet {unknown}, which nobody sent")
        link = _link(rows["receiver"], sent["source"][packet])
        order = np.lexsort((rows["time"], link))
        links, rank = np.unique(link[order], return_inverse=True)
        heard, made = rows["time"][order], sent["time"][packet][order]
        # the newest so far of each link: ranks of times keep the links apart
        moments, moment = np.unique(made, return_inverse=True)
        newest = np.maximum.accumulate(rank * len(moments) + moment) - rank * len(moments)
        stride = len(instants) + 1
        return cls(
            keys=rank * stride + np.searchsorted(instants, heard),
            links=links,
            stride=stride,
            generated=moments[newest] if len(moments) else made,
            heard=heard,
        )

    def at(self, instant: int, receiver: Array, source: Array) -> tuple[Array, Array]:
        """What receivers have of sources at an instant, `NEVER` if nothing, shape (n,) each."""
        never = np.full(len(receiver), NEVER, np.int64)
        if len(self.links) == 0:
            return never, never
        wanted = _link(receiver, source)
        rank = np.searchsorted(self.links, wanted)
        rank[rank == len(self.links)] = 0
        newest = np.searchsorted(self.keys, rank * self.stride + instant, side="right") - 1
        is_known = (self.links[rank] == wanted) & (newest >= 0)
        is_known &= self.keys[newest] // self.stride == rank
        return (
            np.where(is_known, self.generated[newest], never),
            np.where(is_known, self.heard[newest], never),
        )


def _link(receiver: Array, source: Array) -> Array:
    """One number for a receiver and a source; vehicles are below 2^31."""
    return np.asarray((np.asarray(receiver, np.int64) << 32) + source)
