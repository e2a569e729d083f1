"""Neighbour awareness ratio."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from typing_extensions import override

from orchestrator import Measure
from orchestrator.errors import ParameterProblem
from orchestrator.measure import Answer
from orchestrator.parameters import parameter
from orchestrator.recording.reader import Recording
from orchestrator.signal import Array
from studies.measures.bins import bin_columns, bin_of, edges_parameter, edges_problems, shares
from studies.measures.freshness import NEVER, instants_between, neighbours_at
from studies.measures.radio import Kind
from studies.measures.style import draw_shares
from studies.measures.vehicles import beneath, vehicles_in

if TYPE_CHECKING:
    from matplotlib.axes import Axes


@dataclass(frozen=True, slots=True, kw_only=True)
class NeighbourAwareness(Measure):
    """Share of neighbours of which a vehicle has received something lately.

    The neighbourhood awareness ratio (NAR) of Boban and d'Orey, "Exploring the practical limits of
    cooperative awareness in vehicular communications", IEEE TVT 65(6), 2016: of the vehicles with
    radios at a distance, the share from which at least one message was received within `memory`.
    It is looked at once in every `interval`. Neighbours are those of the truth, so that it does not
    depend on what the channel records. Those that have just entered cannot be known yet; they
    count.
    """

    by_default: ClassVar[bool] = True

    packets: str = parameter("facilities.packets", doc="`component.connector`")
    receptions: str = parameter("channel.receptions", doc="`component.connector`")
    vehicle: str = parameter("traffic.vehicle", doc="what the signals of vehicles begin with")
    kind: Kind = parameter("bsm", doc="of the messages that count")
    memory: float = parameter(1.0, unit="s", minimum=0.001, doc="how long a message is remembered")
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
        memory = round(self.memory * 1e9)
        bins = len(self.edges) - 1
        there, aware = np.zeros(bins, np.int64), np.zeros(bins, np.int64)
        for each in neighbours_at(
            recording,
            vehicles,
            vehicles.values(recording, f"{self.vehicle}.equipped").astype(bool),
            instants[instants >= vehicles.times[0] + memory],
            packets=self.packets,
            receptions=self.receptions,
            kind=self.kind,
            radius=self.edges[-1],
        ):
            place = bin_of(each.distance, self.edges)
            is_aware = (each.heard != NEVER) & (each.heard > each.time - memory)
            there += np.bincount(place[place >= 0], minlength=bins)
            aware += np.bincount(place[(place >= 0) & is_aware], minlength=bins)
        table = _table(there, aware, self.edges)
        total = int(there.sum())
        return Answer(
            numbers={"nar": int(aware.sum()) / total if total else None, "neighbours": total},
            tables={"distance": table},
            panel=lambda axes: _draw(axes, table),
        )


def _table(there: Array, aware: Array, edges: Sequence[float]) -> dict[str, Array]:
    share, low, high = shares(aware, there)
    counts = {"neighbours": there, "known": aware}
    return {**bin_columns(edges), **counts, "nar": share, "low": low, "high": high}


def _draw(axes: "Axes", table: Mapping[str, Array]) -> None:
    place = (table["from_m"] + table["to_m"]) / 2
    draw_shares(axes, {"all": (place, table["nar"], table["low"], table["high"])})
    axes.set_ylabel("neighbour awareness ratio")
