"""Age of information of neighbours."""

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
from studies.measures.freshness import NEVER, instants_between, neighbours_at
from studies.measures.radio import Kind
from studies.measures.style import draw_quantiles
from studies.measures.vehicles import beneath, vehicles_in


@dataclass(frozen=True, slots=True, kw_only=True)
class AgeOfInformation(Measure):
    r"""Age of the newest information that vehicles have of their neighbours.

    $$ \Delta(t) = t - u(t) $$

    with $u(t)$ the time at which the newest packet received by $t$ was handed to the radio of its
    source (Kaul, Yates, Gruteser, "Real-time status: how often should one update?", IEEE INFOCOM
    2012). It is looked at once in every `interval`, for both directions of all pairs of vehicles
    with radios at the distances of `edges`, and not before the first packet was received:
    `unknown` is the share of pairs and instants for which that is still to come.
    """

    by_default: ClassVar[bool] = True

    packets: str = parameter("facilities.packets", doc="`component.connector`")
    receptions: str = parameter("channel.receptions", doc="`component.connector`")
    vehicle: str = parameter("traffic.vehicle", doc="what the signals of vehicles begin with")
    kind: Kind = parameter("bsm", doc="of the messages that count")
    interval: float = parameter(0.5, unit="s", minimum=0.001, doc="in which is looked once")
    edges: tuple[float, ...] = edges_parameter()

    @override
    def signals(self) -> Sequence[str]:
        return (self.packets, self.receptions, *beneath(self.vehicle, "id", "position", "equipped"))

    @override
    def problems(self, components: Sequence[str]) -> Iterator[ParameterProblem]:
        return edges_problems(self.edges)

    @override
    def compute(self, recording: Recording) -> Answer:
        vehicles = vehicles_in(recording, self.vehicle)
        instants = instants_between(vehicles.times, self.interval)
        ages, places, unknown = [np.empty(0)], [np.empty(0, np.int64)], 0
        for each in neighbours_at(
            recording,
            vehicles,
            vehicles.values(recording, f"{self.vehicle}.equipped").astype(bool),
            instants,
            packets=self.packets,
            receptions=self.receptions,
            kind=self.kind,
            radius=self.edges[-1],
        ):
            place = bin_of(each.distance, self.edges)
            is_known = each.generated != NEVER
            unknown += int(((place >= 0) & ~is_known).sum())
            counts = (place >= 0) & is_known
            ages.append((each.time - each.generated[counts]) * 1e-9)
            places.append(place[counts])
        age = np.concatenate(ages)
        table = spread_by_bin(np.concatenate(places), age, self.edges)
        asked = len(age) + unknown
        return Answer(
            numbers={
                **spread(age * 1e3, "aoi", "ms"),
                "samples": len(age),
                "unknown": unknown / asked if asked else None,
            },
            tables={"distance": table},
            panel=lambda axes: draw_quantiles(axes, table, "age of information"),
        )
