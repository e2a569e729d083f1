"""Post-encroachment time."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from typing_extensions import override

from orchestrator import Measure
from orchestrator.measure import Answer
from orchestrator.parameters import parameter
from orchestrator.recording.reader import Recording
from orchestrator.signal import Array
from studies.measures.passes import Passes, passes_of
from studies.measures.style import distribution, draw_distribution
from studies.measures.vehicles import beneath, vehicles_in


@dataclass(frozen=True, slots=True, kw_only=True)
class PostEncroachment(Measure):
    """Time between one vehicle leaving a place and another arriving there on a crossing path.

    The post-encroachment time of Allen, Shin and Cooper, "Analysis of traffic conflicts and
    collisions", Transportation Research Record 667, 1978. Here places are points of a grid, and the
    time of a pair is the least over all points that both bodies cover one after the other, nobody
    in between, with headings at least `angle` apart: who follows in the same lane encroaches on
    nothing. Between communication points bodies keep their velocity, so that times are not rounded
    to steps. A grid misses the corner of the area that both cover: the time found is up to
    `spacing / speed` of each of the two too long. 0: both were there at once. Those more than 3 m
    higher than the other, on a bridge, are left out where traffic says heights; that of SUMO is on
    flat ground.
    """

    by_default: ClassVar[bool] = True

    vehicle: str = parameter("traffic.vehicle", doc="what the signals of vehicles begin with")
    spacing: float = parameter(0.5, unit="m", minimum=0.05, doc="of the grid")
    angle: float = parameter(
        0.35, unit="rad", minimum=0.0, maximum=3.1, doc="between headings, from which paths cross"
    )
    horizon: float = parameter(5.0, unit="s", minimum=0.0, doc="longer times are left out")
    threshold: float = parameter(1.5, unit="s", minimum=0.0, doc="below which a pair counts")

    @override
    def signals(self) -> Sequence[str]:
        return beneath(self.vehicle, "id", "position", "heading", "velocity", "size")

    @override
    def compute(self, recording: Recording) -> Answer:
        vehicles = vehicles_in(recording, self.vehicle)
        passes = passes_of(recording, vehicles, self.vehicle, self.spacing)
        table = self._table(passes)
        found = table["pet_s"]
        below = found < self.threshold
        involved = np.concatenate([table["first"], table["second"]])
        return Answer(
            numbers={
                "pet_min_s": float(found.min()) if len(found) else None,
                "pairs": len(found),
                "pairs_below": int(below.sum()),
                "vehicles_below": len(np.unique(involved[np.tile(below, 2)])),
                "too_fast": passes.too_fast,
            },
            tables={"pairs": table},
            panel=lambda axes: draw_distribution(
                axes, {"pairs": distribution(np.sort(found))}, "post-encroachment time [s]"
            ),
        )

    def _table(self, passes: Passes) -> dict[str, Array]:
        """The least time of every pair, who was first, when and where; by time."""
        order = np.lexsort((passes.vehicle, passes.enter, passes.cell))
        first, second = order[:-1], order[1:]
        pet = np.maximum(passes.enter[second] - passes.leave[first], 0.0)
        turned = np.abs(passes.heading_enter[second] - passes.heading_leave[first]) % (2 * np.pi)
        counts = passes.cell[first] == passes.cell[second]
        counts &= passes.vehicle[first] != passes.vehicle[second]
        counts &= (pet <= self.horizon) & (np.minimum(turned, 2 * np.pi - turned) >= self.angle)
        counts &= np.abs(passes.z[first] - passes.z[second]) <= 3.0
        first, second, pet = first[counts], second[counts], pet[counts]
        ends = np.sort(np.stack([passes.vehicle[first], passes.vehicle[second]]), axis=0)
        pair = (ends[0] << 32) + ends[1]
        order = np.lexsort((passes.enter[second], pet, pair))
        _, least = np.unique(pair[order], return_index=True)
        rows = order[least]
        rows = rows[np.argsort(passes.enter[second[rows]], kind="stable")]
        x, y = passes.places(second[rows])
        return {
            "first": passes.vehicle[first[rows]],
            "second": passes.vehicle[second[rows]],
            "pet_s": pet[rows],
            "time_s": passes.enter[second[rows]],
            "x_m": x,
            "y_m": y,
        }
