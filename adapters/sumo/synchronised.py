"""A vehicle that reaches a place when another entity does (OpenSCENARIO's SynchronizeAction).

Far from the place it chooses the speed at which it arrives there when the other one would if that
kept its present speed; within `hold_distance` of it it keeps the speed it has, so that only the
other one can still avoid a collision. With the place where an ego vehicle crosses its way this is
the timing of the red-light scenario of AutoCastSim, on whose successor benchmark COOPERNAUT was
evaluated.
"""

import math
from dataclasses import dataclass

from adapters.sumo.entities import Synchronise
from adapters.sumo.errors import SumoError
from adapters.sumo.giving_way import GivingWay
from adapters.sumo.placement import Placed, meeting, place_of
from adapters.sumo.simulation import Sumo
from adapters.sumo.stage import Stage
from adapters.traffic.polyline import Polyline


@dataclass(frozen=True, slots=True, kw_only=True)
class SpeedControl:
    """Speed control of a synchronised vehicle.

    Attributes:
        hold_distance: to the meeting, within which the speed is kept [m].
        min_speed, max_speed: bounds [m/s].
        max_acceleration: bound in both directions [m/s^2].
    """

    hold_distance: float
    min_speed: float
    max_speed: float
    max_acceleration: float

    @classmethod
    def of(cls, wanted: Synchronise) -> "SpeedControl":
        """What a scenario declares."""
        return cls(
            hold_distance=wanted.hold_distance,
            min_speed=wanted.min_speed,
            max_speed=wanted.max_speed,
            max_acceleration=wanted.max_acceleration,
        )

    def speed(
        self, *, speed: float, distance: float, other_speed: float, other_distance: float, h: float
    ) -> float:
        """The speed for the next step.

        Args:
            speed: present speed [m/s].
            distance: to the meeting [m], negative beyond it.
            other_speed: of the other vehicle [m/s].
            other_distance: of the other vehicle to the meeting [m], negative beyond it.
            h: duration of the step [s].
        """
        if distance <= self.hold_distance or other_distance <= 0.0:
            return speed
        wanted = distance * other_speed / other_distance
        bounded = min(max(wanted, self.min_speed), self.max_speed)
        change = self.max_acceleration * h
        return speed + min(max(bounded - speed, -change), change)


class Synchronised:
    """Drives a synchronised vehicle, and makes background vehicles give way to it.

    Args:
        sumo: the simulation.
        placed: the vehicle.
        other: the one that it meets.

    Raises:
        SumoError: their ways do not cross, and no place is given.
    """

    def __init__(self, sumo: Sumo, placed: Placed, other: Placed) -> None:
        wanted = placed.entity.synchronise
        assert wanted is not None  # noqa: S101 - the caller asked
        meets = meeting(other, placed.road, place_of(wanted.x, wanted.y))
        if meets is None:
            raise SumoError(
                f"`entities.{placed.called}.synchronise`: its way does not cross that of "
                f"`{other.called}`; give the place of the meeting as `x` and `y`"
            )
        length, width, _ = placed.vehicle.type.size
        self.giving_way = GivingWay(sumo, placed.road.path, length, width)
        self._sumo = sumo
        self._name = placed.vehicle.name
        self._path = placed.road.path
        self._other_name = other.vehicle.name
        self._other_path: Polyline = other.road.path
        self._meets = meets
        self._control = SpeedControl.of(wanted)

    def drive(self, stage: Stage) -> None:
        """Set the speed of the next step."""
        row = stage.roster.row(self._name)
        if row is None:
            return
        place = self._path.station(*stage.poses.center[row].tolist())
        speed = math.hypot(*stage.poses.velocity[row].tolist())
        other = stage.whereabouts(self._other_name)
        if other is not None:
            speed = self._control.speed(
                speed=speed,
                distance=self._meets.second - place,
                other_speed=other.speed,
                other_distance=self._meets.first - self._other_path.station(*other.center),
                h=stage.h,
            )
        self._sumo.set_speed(self._name, speed)
        self.giving_way.let_pass(stage.roster, stage.poses, place, speed, stage.h)
