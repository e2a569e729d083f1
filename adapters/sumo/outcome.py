"""How the encounter ends for the ego vehicle: in a collision, or beyond the conflict point."""

import math
from dataclasses import dataclass, replace
from typing import Final

from adapters.sumo.proximity import Contact
from adapters.traffic.geometry import Float
from adapters.traffic.polyline import Polyline

NEVER: Final = -1.0
"""The time [s] of what has not happened; signals are finite numbers."""

NO_PARTNER: Final = -1


class FinishLine:
    """A station of the ego's route that its rear bumper has to pass."""

    def __init__(self, path: Polyline, station: float, length: float) -> None:
        """Draw the line at `station` [m] of `path` for a body of `length` [m]."""
        self._path = path
        self._station = station
        self._half = 0.5 * length

    def passed(self, track: Float) -> int | None:
        """The first of the poses `track`, shape (n, 3), beyond the line, if the last one is."""
        if not self._is_beyond(track[-1]):
            return None
        return next(k for k, pose in enumerate(track) if self._is_beyond(pose))

    def _is_beyond(self, pose: Float) -> bool:
        x, y, heading = pose.tolist()
        rear = x - self._half * math.cos(heading), y - self._half * math.sin(heading)
        return self._path.station(*rear) >= self._station


@dataclass(frozen=True, slots=True, kw_only=True)
class Instants:
    """The instants at which bodies are checked: evenly spread, the last one at the end.

    Attributes:
        begin: of the interval [ns].
        duration: of it [ns].
        count: of the instants.
    """

    begin: int
    duration: int
    count: int

    def seconds(self, k: int) -> float:
        """The time of instant `k`, the nearest number to it [s]."""
        return (self.begin * self.count + (k + 1) * self.duration) / (self.count * 10**9)


@dataclass(frozen=True, slots=True, kw_only=True)
class Outcome:
    """What has become of the ego vehicle so far; what has happened stays so.

    Attributes:
        collision_time: when its body was first seen to overlap another one [s]; or `NEVER`.
        partner: the number of that vehicle; or `NO_PARTNER`.
        completion_time: when it was through [s]; `NEVER` before, and for good once it collided.
    """

    collision_time: float = NEVER
    partner: int = NO_PARTNER
    completion_time: float = NEVER
    has_collided: bool = False
    has_completed: bool = False

    @property
    def is_over(self) -> bool:
        """Whether it has collided, or is through."""
        return self.has_collided or self.has_completed

    def after(self, instants: Instants, contact: Contact | None, passed: int | None) -> "Outcome":
        """The outcome one interval later.

        Args:
            instants: at which bodies were checked.
            contact: the first overlap, if there was one.
            passed: at which instant the ego was first beyond the finish line, if it was.
        """
        through = passed is not None and (contact is None or passed < contact.instant)
        outcome = self
        if passed is not None and through and not self.is_over:
            outcome = replace(outcome, has_completed=True, completion_time=instants.seconds(passed))
        if contact is not None and not self.has_collided:
            outcome = replace(
                outcome,
                has_collided=True,
                collision_time=instants.seconds(contact.instant),
                partner=contact.vehicle,
            )
        return outcome
