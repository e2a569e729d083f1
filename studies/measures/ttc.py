"""Time to collision of all pairs of vehicles."""

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
from studies.measures.boxes import time_to_contact
from studies.measures.style import distribution, draw_distribution
from studies.measures.vehicles import Vehicles, beneath, near_pairs, vehicles_in


@dataclass(frozen=True, slots=True, kw_only=True)
class TimeToCollision(Measure):
    """Time until vehicles would collide if all kept their velocities.

    The time to collision of Hayward, "Near-miss determination through use of a scale of danger",
    Highway Research Record 384, 1972, of the bodies as boxes in the plane, for every pair nearer
    than `radius` at every communication point of traffic. `exposed_s` is the time exposed
    time-to-collision of Minderhoud and Bovy (Accident Analysis and Prevention 33, 2001): how long
    vehicles had one below `threshold`, added up over vehicles. The road is not asked: those who
    follow a curve towards each other on lanes side by side would collide if they went straight on.
    Bodies one of which is above the other do not meet.
    """

    by_default: ClassVar[bool] = True

    vehicle: str = parameter("traffic.vehicle", doc="what the signals of vehicles begin with")
    radius: float = parameter(
        100.0, unit="m", minimum=1.0, doc="distance of the middles up to which pairs are looked at"
    )
    threshold: float = parameter(1.5, unit="s", minimum=0.0, doc="below which a pair counts")

    @override
    def signals(self) -> Sequence[str]:
        return beneath(self.vehicle, "id", "position", "heading", "velocity", "size")

    @override
    def compute(self, recording: Recording) -> Answer:
        vehicles = vehicles_in(recording, self.vehicle)
        bodies = _Bodies.of(recording, vehicles, self.vehicle)
        least = _Least(len(vehicles.ids))
        pairs: list[Array] = []
        looked = 0
        for _, rows in vehicles.slices():
            a, b = near_pairs(vehicles, np.arange(rows.start, rows.stop), self.radius)
            looked += len(a)
            ttc = bodies.time_to_collision(vehicles, a, b)
            least.note(a, b, ttc)
            is_short = ttc < self.threshold
            pairs.append(
                np.stack([vehicles.ids[a[is_short]], vehicles.ids[b[is_short]]], axis=1).reshape(
                    -1, 2
                )
            )
        table = least.table(vehicles)
        minimum = table["ttc_s"]
        short = np.concatenate([np.empty((0, 2), np.int64), *pairs])
        known = minimum[~np.isnan(minimum)]
        return Answer(
            numbers={
                "ttc_min_s": float(known.min()) if len(known) else None,
                "vehicles": len(minimum),
                "vehicles_below": int((known < self.threshold).sum()),
                "pairs_below": len(np.unique(short, axis=0)),
                "contacts": int((known == 0.0).sum()),
                "exposed_s": _exposed(vehicles, least.values, self.threshold),
                "looked_at": looked,
            },
            tables={"vehicles": table},
            panel=lambda axes: draw_distribution(
                axes,
                {"least of each vehicle": distribution(np.sort(known[known <= 10.0]))},
                "time to collision [s]",
            ),
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class _Bodies:
    """The boxes of all rows of vehicles, and how they move."""

    heading: Array
    velocity: Array
    size: Array

    @classmethod
    def of(cls, recording: Recording, vehicles: Vehicles, vehicle: str) -> "_Bodies":
        return cls(
            heading=vehicles.values(recording, f"{vehicle}.heading"),
            velocity=vehicles.values(recording, f"{vehicle}.velocity"),
            size=vehicles.values(recording, f"{vehicle}.size"),
        )

    def time_to_collision(self, vehicles: Vehicles, a: Array, b: Array) -> Array:
        """The time for rows `a` and `b` [s], infinite if they never meet, shape (pair,)."""
        place, size = vehicles.position, self.size
        found = time_to_contact(
            place[b, :2] - place[a, :2],
            self.velocity[b] - self.velocity[a],
            (self.heading[a], self.heading[b]),
            (size[a, :2], size[b, :2]),
        )
        lowest, tops = np.maximum(place[a, 2], place[b, 2]), place[:, 2] + size[:, 2]
        return np.where(lowest < np.minimum(tops[a], tops[b]), found, np.inf)


class _Least:
    """The least time to collision of every row of vehicles, and with whom."""

    def __init__(self, rows: int) -> None:
        self.values = np.full(rows, np.inf)
        self._other = np.full(rows, -1, np.int64)

    def note(self, a: Array, b: Array, ttc: Array) -> None:
        """Take the pairs of one communication point into account."""
        is_finite = np.isfinite(ttc)
        a, b, ttc = a[is_finite], b[is_finite], ttc[is_finite]
        own, other = np.concatenate([a, b]), np.concatenate([b, a])
        both = np.concatenate([ttc, ttc])
        order = np.lexsort((other, both, own))  # of equals, the lower number
        own, first = np.unique(own[order], return_index=True)
        self.values[own] = both[order][first]
        self._other[own] = other[order][first]

    def table(self, vehicles: Vehicles) -> dict[str, Array]:
        """The least one of every vehicle, by number; NaN where it has none."""
        order = np.lexsort((vehicles.points, self.values, vehicles.ids))
        ids, first = np.unique(vehicles.ids[order], return_index=True)
        rows = order[first]
        is_there = np.isfinite(self.values[rows])
        times = vehicles.times[vehicles.points[rows]] / 1e9
        return {
            "vehicle": ids,
            "ttc_s": np.where(is_there, self.values[rows], np.nan),
            "time_s": np.where(is_there, times, np.nan),
            "other": np.where(is_there, vehicles.ids[self._other[rows]], -1),
        }


def _exposed(vehicles: Vehicles, values: Array, threshold: float) -> float:
    """How long vehicles were below the threshold, added up [s]."""
    steps = np.diff(vehicles.times, append=vehicles.times[-1:]) * 1e-9
    return float(steps[vehicles.points[values < threshold]].sum())
