"""Packet inter-reception time."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from typing_extensions import override

from orchestrator import Measure
from orchestrator.errors import ParameterProblem
from orchestrator.measure import Answer
from orchestrator.parameters import parameter
from orchestrator.recording.reader import Recording
from orchestrator.signal import Array
from studies.measures.bins import (
    bin_of,
    edges_parameter,
    edges_problems,
    spread_by_bin,
    spread_of,
)
from studies.measures.links import Links, lengthened, link
from studies.measures.radio import Kind, received
from studies.measures.style import draw_quantiles
from studies.measures.vehicles import ABSENT, beneath, plane_distance, vehicles_in


@dataclass(frozen=True, slots=True, kw_only=True)
class PacketInterReception(Measure):
    """Time between two packets of one kind that a radio receives from the same transmitter.

    It is the packet inter-reception (PIR) of 3GPP TR 36.885, annex A, and TR 37.885, type 1: the
    time between two successive successful receptions of different packets from one transmitter at
    one receiver. It is assigned to the distance at the second of them.

    Gaps that are open when the run ends, or when one of the two leaves, are left out, and so are
    links over which one packet or none was received; `links_once` counts the former.
    """

    by_default: ClassVar[bool] = True

    receptions: str = parameter("channel.receptions", doc="`component.connector`")
    vehicle: str = parameter("traffic.vehicle", doc="what the signals of vehicles begin with")
    kind: Kind = parameter("bsm", doc="of the messages that count")
    edges: tuple[float, ...] = edges_parameter()

    @override
    def signals(self) -> Sequence[str]:
        return (self.receptions, *beneath(self.vehicle, "id", "position"))

    @override
    def problems(self, components: Sequence[str]) -> Iterator[ParameterProblem]:
        return edges_problems(self.edges)

    @override
    def compute(self, recording: Recording) -> Answer:
        vehicles = vehicles_in(recording, self.vehicle)
        last = _Last()
        gaps, places = [np.empty(0)], [np.empty(0, np.int16)]
        for batch in received(recording, self.receptions).batches(self.kind):
            later, gap = last.gaps(batch.records)
            points = vehicles.at(batch.times[later])
            a = vehicles.rows(points, batch.records["transmitter"][later])
            b = vehicles.rows(points, batch.records["receiver"][later])
            place = bin_of(plane_distance(vehicles, a, b), self.edges)
            counts = (place >= 0) & (a != ABSENT) & (b != ABSENT)
            gaps.append(gap[counts])
            places.append(place[counts].astype(np.int16))
        found = np.concatenate(gaps)
        gaps.clear()
        table = spread_by_bin(np.concatenate(places), found, self.edges)
        found *= 1e3  # [ms]
        found.sort()
        return Answer(
            numbers={
                **spread_of(found, "pir", "ms"),
                "gaps": len(found),
                "links": len(last.counts),
                "links_once": int((last.counts == 1).sum()),
            },
            tables={"distance": table},
            panel=lambda axes: draw_quantiles(axes, table, "inter-reception time"),
        )


class _Last:
    """The last reception over every link until now.

    Attributes:
        counts: how many there were of each, shape (link,).
    """

    def __init__(self) -> None:
        self.counts = np.empty(0, np.int64)
        self._times = np.empty(0, np.int64)
        self._links = Links()

    def gaps(self, rows: Array) -> tuple[Array, Array]:
        """The receptions that follow one over the same link, and how long after it.

        Args:
            rows: the next receptions, shape (n,).

        Returns:
            Indices into `rows`, and times since the reception before [s], shape (gap,) each.
        """
        links = self._links.meet(link(rows["transmitter"], rows["receiver"]))
        self.counts = lengthened(self.counts, len(self._links), 0)
        self._times = lengthened(self._times, len(self._links), 0)
        order = np.lexsort((rows["time"], links))
        links, times = links[order], rows["time"][order]
        is_first = np.concatenate([[True], links[1:] != links[:-1]])[: len(order)]
        is_last = np.concatenate([is_first[1:], [True]])[: len(order)]
        before = np.concatenate([[0], times[:-1]])[: len(order)]
        before[is_first] = self._times[links[is_first]]
        follows = ~is_first | (self.counts[links] > 0)
        self._times[links[is_last]] = times[is_last]
        self.counts += np.bincount(links, minlength=len(self.counts))
        return order[follows], (times - before)[follows] * 1e-9
