"""Packet reception ratio over distance."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, Final

import numpy as np
from typing_extensions import override

from fmus.messages.records import FATES, LINKS, RECEPTION, TRANSMISSION
from orchestrator import Measure
from orchestrator.errors import ParameterProblem
from orchestrator.measure import Answer
from orchestrator.parameters import parameter
from orchestrator.recording.reader import Recording
from orchestrator.signal import Array
from studies.measures.bins import (
    bin_columns,
    bin_of,
    edges_parameter,
    edges_problems,
    share,
    shares,
)
from studies.measures.intended import intended_ratio
from studies.measures.radio import RECEIVED, Kind, batches, table_of, weak_recorded
from studies.measures.style import draw_shares
from studies.measures.vehicles import ABSENT, Vehicles, beneath, plane_distance, vehicles_in

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_SENT: Final = FATES.index("sent")
_ALL: Final = "all"
_LEFT_OUT: Final = "weak_receptions: false; classes count noticed frames only"


@dataclass(frozen=True, slots=True, kw_only=True)
class PacketReceptionRatio(Measure):
    r"""Share of the radios at a distance from a sender that receive its frames.

    $$ PRR_{[a, b)} = \sum_i X_i / \sum_i Y_i $$

    with $Y_i$ the radios whose distance from the sender of frame $i$ is in $[a, b)$, and $X_i$
    those of them that received it (3GPP TR 36.885, annex A, and TR 37.885, PRR type 1, "average
    PRR"). The distance is that of the middles of the bodies in the plane, at the newest
    communication point of traffic when the channel told the reception. Every hop of a packet is a
    frame of its own.

    If the channel leaves out frames below the sensitivity, radios are counted from what was sent
    and where everybody was; the link of a frame that nobody noticed is not known, so that link
    classes then count noticed frames only, which raises their ratios. `weak_recorded` says it.

    `prr2` is the ratio of type 2: of packets with a destination, the share that it received.
    """

    by_default: ClassVar[bool] = True

    receptions: str = parameter("channel.receptions", doc="`component.connector`")
    transmissions: str = parameter(
        "channel.transmissions", doc="`component.connector`; read if `weak_recorded` is not true"
    )
    packets: str = parameter(
        "facilities.packets", doc="`component.connector`; for `prr2`, read if recorded"
    )
    vehicle: str = parameter("traffic.vehicle", doc="what the signals of vehicles begin with")
    kind: Kind = parameter("any", doc="of the messages that count")
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
        tried, heard, unplaced = self._told(recording, vehicles)
        weak = weak_recorded(recording, self.receptions)
        everybody = tried.sum(axis=0) if weak else self._in_range(recording, vehicles)
        table = self._table(
            np.concatenate([everybody[None], tried]),
            np.concatenate([heard.sum(axis=0)[None], heard]),
        )
        numbers: dict[str, float | int | bool | str | None] = {"weak_recorded": weak}
        for name in (_ALL, *LINKS):
            own = table["link"] == name
            numbers |= _total(name, table["receivers"][own].sum(), table["received"][own].sum())
        numbers["unplaced"] = unplaced
        numbers["left_out"] = left_out = None if weak is not False else _LEFT_OUT
        numbers |= intended_ratio(recording, self.packets, self.receptions, self.kind)
        return Answer(
            numbers=numbers,
            tables={"distance": table},
            panel=lambda axes: _draw(axes, table, left_out),
        )

    def _told(self, recording: Recording, vehicles: Vehicles) -> tuple[Array, Array, int]:
        """Receptions and those received, by class and bin; and how many have no distance."""
        bins = len(self.edges) - 1
        shape = (len(LINKS), bins)
        tried, heard, unplaced = np.zeros(shape, np.int64), np.zeros(shape, np.int64), 0
        for batch in batches(recording, self.receptions, "RCPT", RECEPTION, self.kind):
            rows, points = batch.records, vehicles.at(batch.times)
            a = vehicles.rows(points, rows["transmitter"])
            b = vehicles.rows(points, rows["receiver"])
            is_placed = (a != ABSENT) & (b != ABSENT)
            unplaced += int((~is_placed).sum())
            place = bin_of(plane_distance(vehicles, a, b), self.edges)
            counts = is_placed & (place >= 0)
            cell = rows["link"][counts].astype(np.int64) * bins + place[counts]
            is_heard = rows["outcome"][counts] == RECEIVED
            tried += np.bincount(cell, minlength=tried.size).reshape(shape)
            heard += np.bincount(cell[is_heard], minlength=tried.size).reshape(shape)
        return tried, heard, unplaced

    def _in_range(self, recording: Recording, vehicles: Vehicles) -> Array:
        """The radios in every bin around each frame that was sent, summed, shape (bin,)."""
        sent = table_of(recording, self.transmissions, "SENT", TRANSMISSION, self.kind)
        on_air = sent.records["fate"] == _SENT
        points = vehicles.at(sent.times[on_air])
        rows = vehicles.rows(points, sent.records["transmitter"][on_air])
        rows = np.sort(rows[rows != ABSENT])
        has_radio = vehicles.values(recording, f"{self.vehicle}.equipped").astype(bool)
        starts = np.searchsorted(rows, vehicles.first)
        found = np.zeros(len(self.edges) - 1, np.int64)
        for point, present in vehicles.slices():
            senders = rows[starts[point] : starts[point + 1]]
            if len(senders):
                radios = np.flatnonzero(has_radio[present]) + present.start
                distance = plane_distance(vehicles, senders[:, None], radios)
                place = bin_of(distance[senders[:, None] != radios], self.edges)
                found += np.bincount(place[place >= 0], minlength=len(found))
        return found

    def _table(self, tried: Array, heard: Array) -> dict[str, Array]:
        """A row for every class, all first, and bin."""
        names = (_ALL, *LINKS)
        bounds = {name: np.tile(c, len(names)) for name, c in bin_columns(self.edges).items()}
        counts, hits = tried.ravel(), heard.ravel()
        ratio, low, high = shares(hits, counts)
        return {
            "link": np.repeat(names, len(self.edges) - 1),
            **bounds,
            "receivers": counts,
            "received": hits,
            "prr": ratio,
            "low": low,
            "high": high,
        }


def _total(name: str, tried: Any, heard: Any) -> dict[str, float | int | None]:
    """The ratio over all bins, with its interval."""
    ending = "" if name == _ALL else f"_{name}"
    return {**share(int(heard), int(tried), f"prr{ending}"), f"receivers{ending}": int(tried)}


def _draw(axes: "Axes", table: Mapping[str, Array], left_out: str | None) -> None:
    place = (table["from_m"] + table["to_m"]) / 2
    rows = {}
    for name in (_ALL, *LINKS):
        own = table["link"] == name
        rows[name] = (place[own], table["prr"][own], table["low"][own], table["high"][own])
    draw_shares(axes, rows)
    axes.set_ylabel("packet reception ratio")
    if left_out is not None:
        axes.text(1.0, 1.0, left_out, transform=axes.transAxes, ha="right", fontsize="small")
