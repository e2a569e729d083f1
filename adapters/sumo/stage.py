"""What those see that SUMO does not drive, before a step of SUMO."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

from adapters.sumo.entities import Trigger
from adapters.sumo.population import Kind, Poses, Roster, key_of


@dataclass(frozen=True, slots=True, kw_only=True)
class Whereabouts:
    """Where somebody is.

    Attributes:
        center: of the body, x and y [m].
        speed: [m/s].
    """

    center: tuple[float, float]
    speed: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Stage:
    """Everybody at the beginning of a step; driven entities have taken theirs.

    Attributes:
        roster: who is there.
        poses: theirs.
        driven: of those that a policy drives, by name.
        elapsed: since the start [s].
        h: duration of the step [s].
    """

    roster: Roster
    poses: Poses
    driven: Mapping[str, Whereabouts]
    elapsed: float
    h: float

    def whereabouts(self, name: str) -> Whereabouts | None:
        """Where `name` is; `None` if it is not there."""
        found = self.driven.get(name)
        if found is not None:
            return found
        row = self.roster.row(name)
        if row is None:
            row = self.roster.row(key_of(name, Kind.PERSON))
        if row is None:
            return None
        x, y = self.poses.center[row].tolist()
        return Whereabouts(center=(x, y), speed=math.hypot(*self.poses.velocity[row].tolist()))


class Start:
    """When an action begins.

    Args:
        trigger: the condition.
        name: of the vehicle that acts.
    """

    def __init__(self, trigger: Trigger, name: str) -> None:
        self._trigger = trigger
        self._name = name
        self._begun: float | None = None

    def since(self, stage: Stage) -> float | None:
        """How long the action has been going on [s]; `None` before it begins."""
        if self._begun is None and self._holds(stage):
            self._begun = stage.elapsed
        return None if self._begun is None else stage.elapsed - self._begun

    def _holds(self, stage: Stage) -> bool:
        wanted = self._trigger
        if stage.elapsed < wanted.after:
            return False
        if not wanted.entity:
            return True
        own, other = stage.whereabouts(self._name), stage.whereabouts(wanted.entity)
        if own is None or other is None:
            return False
        apart = math.dist(own.center, other.center)
        return wanted.closer_than is None or apart <= wanted.closer_than
