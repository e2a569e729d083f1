"""The ego vehicle on its way: its state, its route and the track of each step."""

import math

import numpy as np

from adapters.sumo.actuation import Actuation
from adapters.sumo.cast import Role
from adapters.sumo.ego import Command, EgoDynamics, EgoState, advance, velocity
from adapters.traffic.geometry import Float, direction
from orchestrator.timebase import Duration, Time


class EgoDriver:
    """Moves the ego vehicle as it is commanded.

    SUMO only shows it to the other drivers; the state here is the truth.
    """

    def __init__(
        self, role: Role, speed: float, dynamics: EgoDynamics, actuation: Actuation
    ) -> None:
        """Start at the place of `role` with `speed` [m/s]."""
        self._path = role.path
        self._length = role.vehicle.type.length
        self._dynamics = dynamics
        self._actuation = actuation
        front = role.departure.position
        x, y = role.path.at(front - 0.5 * self._length).tolist()
        along = role.path.at(front) - (x, y)
        self.state = EgoState(x=x, y=y, heading=math.atan2(along[1], along[0]), speed=speed)

    @property
    def center(self) -> Float:
        """The centre of the body [m], shape (2,)."""
        return np.array([self.state.x, self.state.y])

    @property
    def front(self) -> Float:
        """Centre of the front bumper [m], shape (2,)."""
        return self.center + 0.5 * self._length * direction(np.array(self.state.heading))

    @property
    def velocity(self) -> Float:
        """The velocity of the body's centre [m/s], shape (2,)."""
        return velocity(self.state)

    @property
    def pose(self) -> Float:
        """Centre x, y [m] and heading [rad], shape (3,)."""
        return np.array([self.state.x, self.state.y, self.state.heading])

    @property
    def station(self) -> float:
        """The distance of the body's centre along the route [m]."""
        return self._path.station(self.state.x, self.state.y)

    @property
    def route(self) -> Float:
        """Centre line of the route ahead [m], shape (vertex, 2)."""
        return self._path.beyond(self.station)

    @property
    def at_end(self) -> bool:
        """Whether the front bumper has reached the end of the route."""
        return self._path.station(*self.front.tolist()) >= self._path.length

    def distance_to(self, station: float) -> float:
        """Distance along the route from the body's centre to `station` [m]; negative beyond it."""
        return station - self.station

    def drive(self, command: Command, now: Time, duration: Duration, count: int) -> Float:
        """Drive for `duration` [ns] from `now` [ns] on, while `command` is asked for.

        Returns:
            The pose at `count` instants, evenly spread up to the end, shape (count, 3).
        """
        track = np.empty((count, 3))
        self._actuation.give(now, command)
        for k, pieces in enumerate(self._actuation.pieces(now, duration, count)):
            for piece in pieces:
                self.state = advance(self.state, piece.command, self._dynamics, piece.duration)
            track[k] = self.pose
        return track
