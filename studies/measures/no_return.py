"""The point of no return: until when braking still avoids that two meet."""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from orchestrator.signal import Array

_PARALLEL: Final = math.sin(math.radians(10.0))
"""Sine of the angle below which two ways do not cross."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Body:
    """A box in the plane that keeps its velocity.

    Attributes:
        center: its middle [m], shape (2,).
        heading: counter-clockwise from east [rad].
        velocity: [m/s], shape (2,).
        size: length and width [m], shape (2,).
    """

    center: Array
    heading: float
    velocity: Array
    size: Array

    @property
    def speed(self) -> float:
        """How fast it is [m/s]."""
        return float(np.hypot(*self.velocity))

    def reach(self, direction: Array) -> float:
        """How far it reaches from its middle along a unit vector of shape (2,) [m]."""
        ahead = np.array([math.cos(self.heading), math.sin(self.heading)])
        length, width = 0.5 * self.size
        along, across = float(ahead @ direction), float(_left(ahead) @ direction)
        return float(length * abs(along) + width * abs(across))


@dataclass(frozen=True, slots=True, kw_only=True)
class Conflict:
    """Two whose ways cross and who would meet there if both kept their velocities.

    Attributes:
        distance: how far the first one still drives before it enters the way of the other [m].
        begin: when the other enters the way of the first one, from now [s].
        end: when it has left it, from now [s].
    """

    distance: float
    begin: float
    end: float

    def meeting(self, speed: float) -> float:
        """When both are in each other's way if the first one keeps `speed` [m/s], from now [s]."""
        return max(self.distance / speed, self.begin)

    def last_moment(self, speed: float, deceleration: float, reaction: float) -> float:
        r"""Until when the first one may decide to brake and not be met, from now [s].

        With the speed $v$, the deceleration $a$, the time $r$ from the decision to it, the distance
        $d$ and the end $t_e$ of the conflict, it would be $o = v t_e - d$ into the way of the other
        when that leaves it. Braking takes $o$ away in $\sqrt{2 o / a}$, during which the vehicle
        still rolls if that is less than $v / a$; otherwise it stops before the way:

        $$ t = t_e - r - \sqrt{2 o / a} \quad (2 o a \le v^2), \qquad
           t = d / v - r - v / (2 a) \quad (2 o a > v^2). $$

        Args:
            speed: of the first one until then [m/s], above 0.
            deceleration: constant, from the reaction on [m/s^2], above 0.
            reaction: from the decision to the deceleration [s]; the time constant of brakes that
                lag behind is part of it.

        Returns:
            Negative where it is too late already.
        """
        overshoot = speed * self.end - self.distance
        if 2.0 * overshoot * deceleration <= speed**2:
            return self.end - reaction - math.sqrt(2.0 * max(overshoot, 0.0) / deceleration)
        return self.distance / speed - reaction - speed / (2.0 * deceleration)


def conflict(first: Body, other: Body) -> Conflict | None:
    """The conflict of two bodies whose ways cross.

    The way of a body is the strip that it sweeps; where ways cross at an angle other than a right
    one, bodies may miss each other though both are within the strips.

    Args:
        first: who might brake.
        other: who keeps its velocity.

    Returns:
        `None` if one of them stands, their ways are nearly parallel or do not cross ahead of both,
        or one has passed before the other arrives.
    """
    if first.speed == 0.0 or other.speed == 0.0:
        return None
    own, its = first.velocity / first.speed, other.velocity / other.speed
    across = abs(float(own @ _left(its)))
    if across < _PARALLEL:
        return None
    offset = other.center[:2] - first.center[:2]
    until = _strip(float(offset @ _left(its)), float(own @ _left(its)), _both(first, other, its))
    during = _strip(-float(offset @ _left(own)), float(its @ _left(own)), _both(first, other, own))
    enters, leaves = (way / first.speed for way in until)
    begin, end = (way / other.speed for way in during)
    if leaves <= 0.0 or end <= 0.0 or enters >= end or begin >= leaves:
        return None
    return Conflict(distance=max(until[0], 0.0), begin=max(begin, 0.0), end=end)


def _strip(offset: float, rate: float, reach: float) -> tuple[float, float]:
    """From which to which way [m] something is within `reach` of an `offset` that it nears.

    Args:
        offset: of the middle of the strip [m].
        rate: how much of the way is across the strip, -1 to 1, not 0.
        reach: half the width of the strip with the body in it [m].
    """
    middle = offset / rate
    half = reach / abs(rate)
    return middle - half, middle + half


def _both(first: Body, other: Body, along: Array) -> float:
    """How far both reach together across the direction `along` [m]."""
    return first.reach(_left(along)) + other.reach(_left(along))


def _left(direction: Array) -> Array:
    return np.array([-direction[1], direction[0]])
