"""Background vehicles give way to an entity that ignores lights and right of way.

In SUMO they would see it only once it is on the junction, too late for some of them, and drive
through it.
"""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from adapters.sumo.population import Poses, Roster
from adapters.sumo.simulation import Sumo
from adapters.traffic.geometry import Float, direction
from adapters.traffic.polyline import Polyline

_MARGIN: Final = 2.0
"""Time [s] that other drivers keep before and behind the other one at a crossing."""

_HORIZON: Final = 8.0
"""Other drivers adapt their speed when it is closer than this [s]."""

_STANDING: Final = 0.1
"""Slower than this [m/s] it counts as standing."""

_COMFORTABLE_BRAKING: Final = 3.0
"""How hard other drivers brake to give way [m/s^2]; AASHTO's comfortable deceleration is 3.4."""

_CLEARANCE: Final = 0.5
"""Distance kept between the bodies when one passes behind the other [m]."""

_LONGEST_BODY: Final = 25.0
"""This far [m] beyond the last crossing the one that passes has left it for certain."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Passage:
    """Bodies on their way to crossings of paths, each array of shape (crossing,).

    Attributes:
        way: from the body's centre to the crossing [m], negative beyond it.
        reach: half the length of the body and half the width of the other one [m]: the bodies
            can touch only while both are closer to the crossing than this.
        speed: [m/s].
    """

    way: Float
    reach: Float
    speed: Float


def yielding_speed(other: Passage, passing: Passage, h: float) -> Float:
    """The speeds with which other drivers let another one pass first.

    Args:
        other: the vehicles that may have to give way.
        passing: the one to give way to, at the same crossings.
        h: duration of the step [s].

    Returns:
        Speeds for the next step [m/s], shape (crossing,); not a number where no driver has to
        give way: one of them is through already, would be through long before the other comes,
        or would come long after the other is through.
    """
    pace = np.maximum(passing.speed, _STANDING)
    arrives = (passing.way - passing.reach) / pace
    leaves = (passing.way + passing.reach) / pace
    front, rear = other.way - other.reach, other.way + other.reach
    meets = (leaves > 0.0) & (arrives < _HORIZON) & (front > 0.0)
    meets &= rear > other.speed * (arrives - _MARGIN)
    meets &= front < other.speed * (leaves + _MARGIN)
    braking = np.maximum(other.speed - _COMFORTABLE_BRAKING * h, 0.0)
    slow = np.maximum(front / np.maximum(leaves + _MARGIN, _MARGIN), braking)
    return np.where(meets, slow, np.nan)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Crossings:
    """The vehicles of a roster whose paths cross that of the one that passes.

    Attributes:
        rows: of these vehicles, shape (crossing,).
        point: where the paths cross [m], shape (crossing, 2).
        station: the same along the path of the one that passes [m], shape (crossing,).
        reach, passing_reach: see `Passage` [m], shape (crossing,).
    """

    roster: Roster
    rows: npt.NDArray[np.intp]
    point: Float
    station: Float
    reach: Float
    passing_reach: Float


class GivingWay:
    """Lets background vehicles give way to one that passes.

    Args:
        sumo: the simulation.
        path: of the one that passes.
        length: of its body [m].
        width: of its body [m].
    """

    def __init__(self, sumo: Sumo, path: Polyline, length: float, width: float) -> None:
        self._sumo = sumo
        self._path = path
        self._length, self._width = length, width
        self._points: dict[str, Float] = {}
        self._stations: dict[str, float] = {}
        self._yielding: frozenset[str] = frozenset()
        self._last_crossing = -math.inf
        self._crossings = self._crossings_of(Roster.empty())

    def watch(self, name: str, path: Polyline) -> None:
        """Note a vehicle on its `path` that may have to give way."""
        point = path.crossing(self._path)
        if point is not None:
            station = self._path.station(*point)
            self._points[name] = point
            self._stations[name] = station
            self._last_crossing = max(self._last_crossing, station + _LONGEST_BODY)

    def let_pass(self, roster: Roster, poses: Poses, place: float, speed: float, h: float) -> None:
        """Slow the others down for the one that passes.

        Args:
            roster: who is there.
            poses: theirs.
            place: of the one that passes, along its path [m].
            speed: of it [m/s].
            h: duration of the step [s].
        """
        if not (place < self._last_crossing or self._yielding):
            return
        if self._crossings.roster is not roster:
            self._crossings = self._crossings_of(roster)
        crossings = self._crossings
        rows = crossings.rows
        ahead = direction(poses.heading[rows])
        wanted = yielding_speed(
            Passage(
                way=((crossings.point - poses.center[rows]) * ahead).sum(axis=1),
                reach=crossings.reach,
                speed=(poses.velocity[rows] * ahead).sum(axis=1),
            ),
            Passage(
                way=crossings.station - place,
                reach=crossings.passing_reach,
                speed=np.full(len(rows), speed),
            ),
            h,
        )
        slow = np.flatnonzero(~np.isnan(wanted))
        speeds = {roster.names[rows[k]]: float(wanted[k]) for k in slow}
        for name, limit in speeds.items():
            self._sumo.set_speed(name, limit)
        for name in sorted(self._yielding - speeds.keys()):
            if roster.row(name) is not None:
                self._sumo.set_speed(name, None)
        self._yielding = frozenset(speeds)

    def _crossings_of(self, roster: Roster) -> _Crossings:
        rows = [row for row, name in enumerate(roster.names) if name in self._points]
        names = [roster.names[row] for row in rows]
        size = roster.size[rows]
        return _Crossings(
            roster=roster,
            rows=np.array(rows, dtype=np.intp),
            point=np.array([self._points[name] for name in names]).reshape(-1, 2),
            station=np.array([self._stations[name] for name in names]),
            reach=0.5 * (size[:, 0] + self._width) + _CLEARANCE,
            passing_reach=0.5 * (self._length + size[:, 1]) + _CLEARANCE,
        )
