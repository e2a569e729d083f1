"""The collision vehicle on its way, and the drivers who give way to it."""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from adapters.sumo.cast import COLLIDER, Cast
from adapters.sumo.ego_driver import EgoDriver
from adapters.sumo.encounter import Passage, SpeedControl, yielding_speed
from adapters.sumo.fleet import Poses, Roster
from adapters.sumo.simulation import Sumo
from adapters.sumo.spawning import Spawned
from adapters.traffic.geometry import Float, direction

_CLEARANCE: Final = 0.5
"""Distance kept between the bodies when one passes behind the other [m]."""

_LONGEST_BODY: Final = 25.0
"""This far [m] beyond the last crossing the collision vehicle has left it for certain."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Crossings:
    """The vehicles of a roster whose paths cross that of the collision vehicle.

    Attributes:
        rows: of these vehicles, shape (crossing,).
        point: where the paths cross [m], shape (crossing, 2).
        station: the same along the path of the collision vehicle [m], shape (crossing,).
        reach, collider_reach: see `Passage` [m], shape (crossing,).
    """

    roster: Roster
    rows: npt.NDArray[np.intp]
    point: Float
    station: Float
    reach: Float
    collider_reach: Float


class CollisionDriver:
    """Drives the collision vehicle into the ego's way and makes others give way to it."""

    def __init__(self, sumo: Sumo, cast: Cast, control: SpeedControl) -> None:
        """There is nothing to drive without an encounter, and nobody gives way."""
        self._sumo = sumo
        self._path = cast.collider.path
        self._length, self._width, _ = cast.collider.vehicle.type.size
        self._ego_conflict = cast.ego.path.station(*cast.conflict)
        self._conflict = self._path.station(*cast.conflict)
        self._control = control
        self._points: dict[str, Float] = {}
        self._stations: dict[str, float] = {}
        self._yielding: frozenset[str] = frozenset()
        self._last_crossing = -math.inf
        self._crossings = self._crossings_of(Roster.empty())

    def watch(self, spawned: Spawned) -> None:
        """Note a background vehicle that may have to give way."""
        point = spawned.route.path.crossing(self._path)
        if point is not None:
            station = self._path.station(*point)
            self._points[spawned.vehicle.name] = point
            self._stations[spawned.vehicle.name] = station
            self._last_crossing = max(self._last_crossing, station + _LONGEST_BODY)

    def drive(self, roster: Roster, poses: Poses, ego: EgoDriver, h: float) -> None:
        """Set the speeds of the next step, which lasts `h` [s]."""
        row = roster.row(COLLIDER)
        if row is None:
            return
        place = self._path.station(*poses.center[row].tolist())
        speed = self._control.speed(
            speed=math.hypot(*poses.velocity[row].tolist()),
            distance=self._conflict - place,
            ego_speed=ego.state.speed,
            ego_distance=ego.distance_to(self._ego_conflict),
            h=h,
        )
        self._sumo.set_speed(COLLIDER, speed)
        if place < self._last_crossing or self._yielding:
            self._let_pass(roster, poses, place, speed, h)

    def _let_pass(self, roster: Roster, poses: Poses, place: float, speed: float, h: float) -> None:
        """Slow the others down for the collision vehicle, which is at `place` [m] of its path."""
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
                reach=crossings.collider_reach,
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
            collider_reach=0.5 * (self._length + size[:, 1]) + _CLEARANCE,
        )
