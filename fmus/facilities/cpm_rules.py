"""When a vehicle sends a CPM and what is in it: the generation rules of ETSI TS 103 324 V2.1.1.

Clause 6.1.2.1: generation events come every T_GenCpm; an event may yield nothing. Clause 6.1.2.2:
sensor information goes into the first message and then once per T_AddSensorInformation. Clause
6.1.2.3, objects of type B (vehicles), `ObjectInclusionConfig` 1. Values: annex F, table F.1.
docs/physics-sharing.md says which rules are left out.
"""

import math
from dataclasses import dataclass

import numpy as np

from orchestrator.signal import Array
from orchestrator.timebase import Duration, Time


@dataclass(frozen=True, slots=True, kw_only=True)
class Inclusion:
    """State of an object when it was last included in a message, or now.

    Attributes:
        time: of the generation event [ns].
        position: centre of its box, world frame [m], shape (2,).
        velocity: [m/s], shape (2,).
    """

    time: Time
    position: Array
    velocity: Array


@dataclass(frozen=True, slots=True, kw_only=True)
class InclusionRules:
    """What makes an object worth another inclusion.

    Attributes:
        longest: time after which it is included whatever it does [ns] (T_GenCpmMax).
        position_change: [m] (minPositionChangeThreshold).
        speed_change: [m/s] (minGroundSpeedChangeThreshold).
        orientation_change: of the velocity [rad] (minGroundVelocityOrientationChangeThreshold).
        orientation_speed: slower velocities have no orientation here [m/s]; not in the standard,
            which would compare the directions of noise.
    """

    longest: Duration
    position_change: float
    speed_change: float
    orientation_change: float
    orientation_speed: float

    def include(self, current: Inclusion, last: Inclusion | None) -> bool:
        """Whether an object goes into the message of this generation event.

        Args:
            current: its state, at the time of the event.
            last: at its last inclusion; None if it was never included.
        """
        return (
            last is None
            or current.time - last.time >= self.longest
            or _norm(current.position - last.position) > self.position_change
            or abs(_norm(current.velocity) - _norm(last.velocity)) > self.speed_change
            or self._has_turned(current.velocity, last.velocity)
        )

    def _has_turned(self, current: Array, last: Array) -> bool:
        speeds = _norm(current), _norm(last)
        if min(speeds) < self.orientation_speed:
            return False
        limit = math.cos(self.orientation_change) * speeds[0] * speeds[1]
        return float(current[0] * last[0] + current[1] * last[1]) < limit


class Station:
    """What one vehicle has told others, and since when it tracks what it sees."""

    def __init__(self, rules: InclusionRules) -> None:
        self._rules = rules
        self._included: dict[int, Inclusion] = {}
        self._since: dict[int, Time] = {}

    def select(self, objects: Array, now: Time, most: int) -> Array:
        """Mark the objects that the message of this event includes.

        They count as included from then on.

        Args:
            objects: those of the vehicle's last scan, `OBJECT` records, shape (object,).
            now: time of the generation event [ns].
            most: room in the message; those that waited longest, and new ones, come first.

        Returns:
            Whether each object is included, bool, shape (object,).
        """
        states = {int(row["instance"]): _state(row, now) for row in objects}
        self._since = {
            number: self._since.get(number, int(row["time"]))
            for number, row in zip(states, objects, strict=True)
        }
        due = [
            number
            for number, state in states.items()
            if self._rules.include(state, self._included.get(number))
        ]
        due.sort(key=self._last_time)
        chosen = {number: states[number] for number in due[:most]}
        self._included = self._remembered(now) | chosen
        return np.array([int(number) in chosen for number in objects["instance"]], np.bool_)

    def ages(self, objects: Array, now: Time) -> Array:
        """How long objects have been tracked at `now` [ns].

        Args:
            objects: `OBJECT` records of shape (object,).
            now: time of the generation event [ns].

        Returns:
            Ages [ns], int64, shape (object,).
        """
        since = [self._since.get(int(number), now) for number in objects["instance"]]
        return now - np.array(since, np.int64)

    def _last_time(self, number: int) -> float:
        last = self._included.get(number)
        return -math.inf if last is None else last.time

    def _remembered(self, now: Time) -> dict[int, Inclusion]:
        """The last inclusions, but for those so old that another one is due anyway."""
        oldest = now - self._rules.longest
        return {number: last for number, last in self._included.items() if last.time > oldest}


def _state(row: np.void, now: Time) -> Inclusion:
    return Inclusion(time=now, position=row["position"], velocity=row["velocity"])


def _norm(vector: Array) -> float:
    return math.sqrt(float(vector[0]) ** 2 + float(vector[1]) ** 2)
