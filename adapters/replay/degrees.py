"""Whether a file has degrees where metres are needed: nobody gets as far as its speed says."""

import math
import statistics
from dataclasses import dataclass
from typing import Final

from adapters.replay.findings import Findings, Place
from adapters.replay.snapshot import Snapshot
from orchestrator.timebase import Time, seconds

_LEG: Final = 1.0
"""How far a road user goes by its speed [m] before it is looked where it is."""

_ENOUGH: Final = 100
"""Legs after which it is told what the file has."""

_LONGITUDE, _LATITUDE = 180.0, 90.0
_LEAST, _MOST = 1e-6, 1e-3
"""Degrees for a metre driven: 9e-6 to the north, up to 1e-3 to the east at 89 degrees of latitude.

Who does not move at all, whatever its speed, is no reason to doubt."""


@dataclass(slots=True)
class _Leg:
    """The way of a road user from a place on.

    Attributes:
        x, y: of the place, in the file's unit.
        time: of the last sample [ns].
        speed: at that time [m/s].
        driven: by the speeds since [m].
    """

    x: float
    y: float
    time: Time
    speed: float
    driven: float = 0.0


class Degrees:
    """Looks at the first legs of a file's road users, and refuses the file if they are of degrees.

    Who stands has no legs. Of all legs the median counts: single ones may be anything, as of
    vehicles that are teleported.
    """

    def __init__(self) -> None:
        self._legs: dict[str, _Leg] = {}
        self._shares: list[float] = []
        self._place: Place | None = None
        self._is_told = False

    def take(self, snapshot: Snapshot, findings: Findings) -> None:
        """Look at the next time of the file, in which all numbers are numbers."""
        if self._is_told or not snapshot.places:
            return
        x, y = abs(snapshot.motion[:, :2]).max(axis=0)
        if x > _LONGITUDE or y > _LATITUDE:
            self._is_told = True
            return
        self._place = self._place or snapshot.places[0]
        for key, (x, y, _, speed) in zip(snapshot.keys, snapshot.motion.tolist(), strict=True):
            self._go_on(key, _Leg(x, y, snapshot.time, speed))
        if len(self._shares) >= _ENOUGH:
            self.tell(findings)

    def tell(self, findings: Findings) -> None:
        """Note that the file has degrees, if so; nothing more is looked at."""
        self._is_told, place = True, self._place
        share = statistics.median(self._shares) if self._shares else 0.0
        if place is not None and _LEAST < share < _MOST:
            what = (
                f"`x` and `y` are degrees: they change by {share:.6f} for a metre driven; metres "
                "are needed, which SUMO writes without `--fcd-output.geo`"
            )
            findings.note(place, what)

    def _go_on(self, key: str, now: _Leg) -> None:
        leg = self._legs.setdefault(key, now)
        leg.driven += 0.5 * abs(leg.speed + now.speed) * seconds(now.time - leg.time)
        leg.time, leg.speed = now.time, now.speed
        if leg.driven >= _LEG:
            self._shares.append(math.dist((leg.x, leg.y), (now.x, now.y)) / leg.driven)
            self._legs[key] = now
