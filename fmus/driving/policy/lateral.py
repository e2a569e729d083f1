"""Where across the road a policy drives, and what that allows: in its lane, unless it overtakes."""

import abc
import math
from dataclasses import dataclass

from typing_extensions import override

from fmus.driving.policy.ego import Ego
from orchestrator.signal import Array
from orchestrator.timebase import Time


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Plan:
    """The way ahead.

    Attributes:
        path: to follow, from the ego's centre on [m], (vertex, 2).
        limit: the highest acceleration that it allows [m/s^2]; infinite without a limit.
        yields_to: for whom it makes room: the row of a body, `None` for nobody.
    """

    path: Array
    limit: float = math.inf
    yields_to: int | None = None


class LateralPlanner(abc.ABC):
    """Decides on the way ahead; what it remembers from step to step is of one run."""

    @abc.abstractmethod
    def plan(self, ego: Ego, corners: Array, velocity: Array, now: Time) -> Plan:
        """The way ahead at `now` [ns].

        Args:
            ego: as it is now; its route leads somewhere.
            corners: of all other bodies that are known [m], shape (body, corner, 2).
            velocity: of each [m/s], shape (body, 2).
            now: the communication point [ns], later than that of the call before.
        """


class LaneKeeping(LateralPlanner):
    """Follows its route, whoever is in the way."""

    @override
    def plan(self, ego: Ego, corners: Array, velocity: Array, now: Time) -> Plan:
        return Plan(path=ego.route)
