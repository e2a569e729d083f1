"""Vehicles and persons that do what the scenario says: speeds on their way, or points to follow.

Neither lights nor other vehicles change what they do.
"""

import math
from typing import Final

import numpy as np

from adapters.sumo.placement import Anywhere, Placed
from adapters.sumo.simulation import Sumo
from adapters.sumo.stage import Stage, Start
from adapters.traffic.geometry import Float, direction

_ROUNDING: Final = 1e-9
"""Times [s] that differ by less are one: those of steps are sums."""


class SpeedProfile:
    """Keeps the speeds of a profile on its way; before it begins, the speed at the start.

    From that one the speed changes evenly to that of the first point.

    Args:
        sumo: the simulation.
        placed: a vehicle on the road.
    """

    def __init__(self, sumo: Sumo, placed: Placed) -> None:
        points = placed.entity.speed_profile
        self._sumo = sumo
        self._name = placed.road.departure.name
        self._initial = placed.speed
        self._times = np.array([0.0, *(point.time for point in points)])
        self._speeds = np.array([self._initial, *(point.speed for point in points)])
        self._start = Start(placed.entity.trigger, self._name)

    def drive(self, stage: Stage) -> None:
        """Set the speed of the next step, that of its end."""
        if stage.roster.row(self._name) is None:
            return
        since = self._start.since(stage)
        speed = self._initial
        if since is not None:
            speed = float(np.interp(since + stage.h, self._times, self._speeds))
        self._sumo.set_speed(self._name, speed)


class Trajectory:
    """Moves a body along given points at given times, on the road or beside it.

    Before it begins the body stands at its first point, after the last one there. SUMO shows it to
    its drivers where it is; those on the same lane react to it.

    Args:
        placed: somebody placed by coordinates.
    """

    def __init__(self, placed: Placed) -> None:
        assert isinstance(placed.place, Anywhere)  # noqa: S101 - the caller asked
        points = placed.entity.trajectory
        times = np.array([0.0, *(point.time for point in points)])
        x, y = placed.place.center.tolist()
        places = np.array([(x, y), *((point.x, point.y) for point in points)])
        if len(points) and points[0].time == 0.0:
            times, places = times[1:], places[1:]
        self.name = placed.vehicle.name
        self._times, self._places = times, places
        self._half = 0.5 * placed.vehicle.type.length
        self._start = Start(placed.entity.trigger, self.name)
        self.center: Float = places[0]
        self.heading = placed.place.heading
        self.velocity: Float = np.zeros(2)

    @property
    def front(self) -> Float:
        """The middle of the front [m], shape (2,)."""
        return self.center + self._half * direction(np.array(self.heading))

    def advance(self, stage: Stage) -> None:
        """Move on by a step; velocity and heading are those of the piece it ends on."""
        since = self._start.since(stage)
        if since is None:
            return
        now = since + stage.h
        self.center = np.array([np.interp(now, self._times, axis) for axis in self._places.T])
        piece = int(np.searchsorted(self._times, now - _ROUNDING, side="left"))
        if piece in {0, len(self._times)}:
            self.velocity = np.zeros(2)
            return
        way = self._places[piece] - self._places[piece - 1]
        self.velocity = way / (self._times[piece] - self._times[piece - 1])
        if way.any():
            self.heading = math.atan2(way[1], way[0])
