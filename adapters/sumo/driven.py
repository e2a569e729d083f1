"""Vehicles that a policy of the system drives: the ego vehicles."""

import math
from collections.abc import Mapping

import numpy as np

from adapters.sumo.actuation import Actuation
from adapters.sumo.ego import Command, EgoDynamics, EgoState, advance, velocity
from adapters.sumo.entities import Entity
from adapters.sumo.errors import SumoError
from adapters.sumo.outcome import NEVER, NO_PARTNER, FinishLine, Instants, Outcome
from adapters.sumo.placement import OnRoad, Placed, meeting, place_of
from adapters.sumo.population import Poses, Roster
from adapters.sumo.proximity import NOBODY, Closest, closest_approach
from adapters.sumo.scene import frozen
from adapters.sumo.simulation import Sumo
from adapters.sumo.stage import Whereabouts
from adapters.traffic.geometry import Float, direction
from orchestrator.signal import Array
from orchestrator.timebase import NANOSECONDS_PER_SECOND, Duration, Time

GONE = -1
"""`id` of a driven entity that is not there: not yet, or no longer."""


class EgoDriver:
    """Moves a vehicle as it is commanded.

    SUMO only shows it to the other drivers; the state here is the truth.
    """

    def __init__(
        self,
        place: OnRoad,
        length: float,
        speed: float,
        dynamics: EgoDynamics,
        actuation: Actuation,
    ) -> None:
        """Start at `place` with a body of `length` [m] and `speed` [m/s]."""
        self._path = place.path
        self._length = length
        self._dynamics = dynamics
        self._actuation = actuation
        front = place.departure.position
        x, y = place.path.at(front - 0.5 * length).tolist()
        along = place.path.at(front) - (x, y)
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


class Ego:
    """A driven entity: its motion, how close it came to others, and how things ended for it.

    Args:
        sumo: the simulation.
        placed: at its place on the road.
        finish: where it is through.
    """

    def __init__(self, sumo: Sumo, placed: Placed, finish: FinishLine) -> None:
        dynamics = placed.entity.dynamics
        length = placed.vehicle.type.length
        actuation = Actuation(
            round(dynamics.pedal_delay * NANOSECONDS_PER_SECOND),
            round(dynamics.steering_delay * NANOSECONDS_PER_SECOND),
        )
        self.name = placed.vehicle.name
        self.driver = EgoDriver(placed.road, length, placed.speed, dynamics.single_track, actuation)
        self._sumo = sumo
        self._finish = finish
        self._size = frozen(np.array(placed.vehicle.type.size))
        self._is_exact = placed.entity.shown == "exactly"
        self._number = GONE
        self._track = self.driver.pose[None]
        self._closest = NOBODY
        self.outcome = Outcome()
        self.is_present = self.has_entered = False

    @property
    def whereabouts(self) -> Whereabouts:
        """Where it is now, or was last."""
        state = self.driver.state
        return Whereabouts(center=(state.x, state.y), speed=state.speed)

    def enter(self, number: int) -> None:
        """It is there from now on, and is called `number`."""
        self._number = number
        self.is_present = self.has_entered = True

    def drive(self, command: Command, now: Time, duration: Duration, count: int) -> bool:
        """Take a step; whether it leaves with it.

        Args:
            command: what its policy asks for.
            now: when the step begins [ns].
            duration: of the step [ns].
            count: instants at which bodies are checked.
        """
        self._track = self.driver.drive(command, now, duration, count)
        if self.driver.at_end:
            self._sumo.withdraw(self.name)
            return True
        heading = self.driver.state.heading
        self._sumo.move(self.name, self.driver.front, heading, exactly=self._is_exact)
        return False

    def look_back(
        self, instants: Instants, before: Roster, a: Poses, now: Roster, b: Poses, *, has_left: bool
    ) -> None:
        """Note what the step that ends now means: the distances kept, and the outcome.

        Others are those who are there both before and now.

        Args:
            instants: at which bodies are checked.
            before: who was there at the beginning of the step.
            a: their poses then.
            now: who is there.
            b: their poses.
            has_left: whether it left with this step; who leaves is through, too.
        """
        closest = self._closest_of(before, a, now, b)
        self._closest = self._closest.or_closer(closest)
        passed = None if self.outcome.is_over else self._finish.passed(self._track)
        if passed is None and has_left:
            passed = len(self._track) - 1
        self.outcome = self.outcome.after(instants, closest.contact, passed)
        if has_left:
            self.is_present = False

    def look_around(self, start: Time, roster: Roster, poses: Poses) -> None:
        """Note how close others are, and whether they touch, when it enters at `start` [ns]."""
        self._track = self.driver.pose[None]
        self._closest = self._closest_of(roster, poses, roster, poses)
        at_start = Instants(begin=start, duration=0, count=1)
        self.outcome = self.outcome.after(at_start, self._closest.contact, None)

    def begin_step(self) -> None:
        """Forget the distances kept before the last communication point."""
        self._closest = NOBODY

    def signals(self) -> Mapping[str, Array]:
        """Its outputs, by what follows its name; `route` has shape (vertex, 2)."""
        driver, outcome, closest = self.driver, self.outcome, self._closest
        return {
            "id": np.array(self._number if self.is_present else GONE),
            "position": driver.center,
            "heading": np.array(driver.state.heading),
            "speed": np.array(driver.state.speed),
            "size": self._size,
            "route": driver.route if self.is_present else np.zeros((0, 2)),
            "collision": np.array(outcome.has_collided),
            "collision_time": np.array(outcome.collision_time),
            "collision_partner": np.array(outcome.partner),
            "completion_time": np.array(outcome.completion_time),
            "gap": np.array(closest.gap),
            "nearest": np.array(closest.vehicle),
        }

    def _closest_of(self, before: Roster, a: Poses, now: Roster, b: Poses) -> Closest:
        """The smallest distance between its body along its track and any other body."""
        old = new = np.flatnonzero(now.number != self._number)
        if now is not before:
            others = now.number[new]
            _, old, new = np.intersect1d(
                before.number, others, assume_unique=True, return_indices=True
            )
            new = np.searchsorted(now.number, others[new])
        return closest_approach(
            self._track,
            self._size[:2],
            number=now.number[new],
            size=now.size[new, :2],
            a=a.rows(old),
            b=b.rows(new),
        )


def signals_of_nobody() -> Mapping[str, Array]:
    """The outputs of a driven entity that does not take part, by what follows its name.

    Shapes are those of `connectors`; its route has shape (0, 2).
    """
    return {
        "id": np.array(GONE),
        "position": np.zeros(2),
        "heading": np.array(0.0),
        "speed": np.array(0.0),
        "size": np.zeros(3),
        "route": np.zeros((0, 2)),
        "collision": np.array(Outcome().has_collided),
        "collision_time": np.array(NEVER),
        "collision_partner": np.array(NO_PARTNER),
        "completion_time": np.array(NEVER),
        "gap": np.array(NOBODY.gap),
        "nearest": np.array(NOBODY.vehicle),
    }


def finish_line(sumo: Sumo, placed: Placed, others: Mapping[str, Placed]) -> FinishLine:
    """Where a driven entity is through.

    Args:
        sumo: the simulation.
        placed: the entity.
        others: those that take part, by the names of their declarations.

    Raises:
        SumoError: its way does not cross that of the one that is named.
    """
    path, wanted = placed.road.path, placed.entity.finish
    length = placed.vehicle.type.length
    if wanted is None:
        return FinishLine(path, math.inf, length)
    at = place_of(wanted.x, wanted.y)
    crossing = others.get(wanted.crossing)
    if at is not None:
        point = np.array(at)
    elif crossing is not None:
        meets = meeting(placed, crossing.road, None)
        if meets is None:
            raise SumoError(
                f"`entities.{placed.called}.finish.crossing`: its way does not cross that of "
                f"`{wanted.crossing}`"
            )
        point = meets.point
    elif placed.road.links:
        point = sumo.net.lane_shape(placed.road.links[0].to_lane)[0]
    else:
        return FinishLine(path, math.inf, length)
    return FinishLine(path, path.station(*point.tolist()) + wanted.distance, length)


def driven(entities: Mapping[str, Entity | None]) -> list[str]:
    """The names of those that policies drive, in the order of their declarations."""
    return [name for name, entity in entities.items() if entity is not None and entity.is_driven]
