r"""The collision vehicle: it runs the red light just when the ego vehicle crosses its path.

Far from the conflict point it chooses the speed at which it arrives there when the ego vehicle
would if that kept its present speed; within `hold_distance` of the point it keeps the speed it
has, so that only the ego vehicle can still avoid the collision. This is the timing of the
red-light scenario of AutoCastSim, on whose successor benchmark COOPERNAUT was evaluated.

Other drivers give way to it. In SUMO they would see it only once it is on the junction, too late
for some of them, and drive through it.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np

from adapters.traffic.geometry import Float

_MARGIN: Final = 2.0
"""Time [s] that other drivers keep before and behind the collision vehicle at a crossing."""

_HORIZON: Final = 8.0
"""Other drivers adapt their speed when the collision vehicle is closer than this [s]."""

_STANDING: Final = 0.1
"""Slower than this [m/s] the collision vehicle counts as standing."""

_COMFORTABLE_BRAKING: Final = 3.0
"""How hard other drivers brake to give way [m/s^2]; AASHTO's comfortable deceleration is 3.4."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SpeedControl:
    """Speed control of the collision vehicle.

    Attributes:
        hold_distance: to the conflict point, within which the speed is kept [m].
        min_speed, max_speed: bounds [m/s].
        max_acceleration: bound in both directions [m/s^2].
    """

    hold_distance: float
    min_speed: float
    max_speed: float
    max_acceleration: float

    def speed(
        self, *, speed: float, distance: float, ego_speed: float, ego_distance: float, h: float
    ) -> float:
        """The speed for the next step.

        Args:
            speed: present speed [m/s].
            distance: to the conflict point [m], negative beyond it.
            ego_speed: of the ego vehicle [m/s].
            ego_distance: of the ego vehicle to the conflict point [m], negative beyond it.
            h: duration of the step [s].
        """
        if distance <= self.hold_distance or ego_distance <= 0.0:
            return speed
        wanted = distance * ego_speed / ego_distance
        bounded = min(max(wanted, self.min_speed), self.max_speed)
        change = self.max_acceleration * h
        return speed + min(max(bounded - speed, -change), change)


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


def yielding_speed(other: Passage, collider: Passage, h: float) -> Float:
    """The speeds with which other drivers let the collision vehicle pass first.

    Args:
        other: the vehicles that may have to give way.
        collider: the collision vehicle, at the same crossings.
        h: duration of the step [s].

    Returns:
        Speeds for the next step [m/s], shape (crossing,); not a number where no driver has to
        give way: one of them is through already, would be through long before the other comes,
        or would come long after the other is through.
    """
    pace = np.maximum(collider.speed, _STANDING)
    arrives = (collider.way - collider.reach) / pace
    leaves = (collider.way + collider.reach) / pace
    front, rear = other.way - other.reach, other.way + other.reach
    meets = (leaves > 0.0) & (arrives < _HORIZON) & (front > 0.0)
    meets &= rear > other.speed * (arrives - _MARGIN)
    meets &= front < other.speed * (leaves + _MARGIN)
    braking = np.maximum(other.speed - _COMFORTABLE_BRAKING * h, 0.0)
    slow = np.maximum(front / np.maximum(leaves + _MARGIN, _MARGIN), braking)
    return np.where(meets, slow, np.nan)
