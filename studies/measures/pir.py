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
from studies.measures.bins import bin_of, edges_parameter, edges_problems, spread, spread_by_bin
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
        batch = received(recording, self.receptions, self.kind)
        rows = batch.records
        link = (rows["transmitter"] << 32) + rows["receiver"]
        order = np.lexsort((rows["time"], link))
        link, times = link[order], rows["time"][order]
        is_next = link[1:] == link[:-1]
        later = order[1:][is_next]
        gaps = np.diff(times)[is_next] * 1e-9  # [s]
        points = vehicles.at(batch.times[later])
        a = vehicles.rows(points, rows["transmitter"][later])
        b = vehicles.rows(points, rows["receiver"][later])
        place = bin_of(plane_distance(vehicles, a, b), self.edges)
        place[(a == ABSENT) | (b == ABSENT)] = -1
        counts = place >= 0
        table = spread_by_bin(place[counts], gaps[counts], self.edges)
        _, per_link = np.unique(link, return_counts=True)
        return Answer(
            numbers={
                **spread(gaps[counts] * 1e3, "pir", "ms"),
                "gaps": int(counts.sum()),
                "links": len(per_link),
                "links_once": int((per_link == 1).sum()),
            },
            tables={"distance": table},
            panel=lambda axes: draw_quantiles(axes, table, "inter-reception time"),
        )
