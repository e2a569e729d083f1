"""Other road users, as they are seen along and across the ego's route."""

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from fmus.driving.policy.route import Segments
from fmus.messages.columns import rows_of
from orchestrator.signal import Array

_MOMENT: Final = 0.1
"""Velocities are measured along and across the route over so long a time [s]."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RoadUsers:
    """Bodies in coordinates along the route and across it.

    Attributes:
        row: which of the bodies that were given each one is, (body,).
        rear, front: where each begins and ends along the route, from the ego's centre on [m],
            (body,).
        right, left: where it begins and ends across it, left positive [m], (body,).
        pace: speed along the route, negative for who comes towards the ego [m/s], (body,).
        drift: speed across it, left positive [m/s], (body,).
    """

    row: Array
    rear: Array
    front: Array
    right: Array
    left: Array
    pace: Array
    drift: Array

    @classmethod
    def along(cls, line: Segments, corners: Array, velocity: Array) -> "RoadUsers":
        """The bodies with these corners.

        Args:
            line: the route.
            corners: of each body [m], shape (body, corner, 2).
            velocity: of each [m/s], shape (body, 2).
        """
        along, across = line.project(corners)
        center = corners.mean(axis=1)
        places = np.stack([center, center + _MOMENT * velocity])
        ways, sides = line.project(places)
        return cls(
            row=np.arange(len(corners)),
            rear=along.min(axis=1, initial=np.inf),
            front=along.max(axis=1, initial=-np.inf),
            right=across.min(axis=1, initial=np.inf),
            left=across.max(axis=1, initial=-np.inf),
            pace=(ways[1] - ways[0]) / _MOMENT,
            drift=(sides[1] - sides[0]) / _MOMENT,
        )

    def mirrored(self) -> "RoadUsers":
        """These road users with left and right exchanged."""
        return replace(self, right=-self.left, left=-self.right, drift=-self.drift)

    def within(self, low: float, high: float) -> Array:
        """Whose bodies reach into the strip between two offsets [m]; a mask, shape (body,)."""
        return np.asarray((self.right < high) & (self.left > low))

    def entering(self, low: float, high: float, *, within: float, faster: float) -> Array:
        """Who will reach into the strip, or does.

        Args:
            low: where it begins across the route [m].
            high: where it ends [m].
            within: how soon [s].
            faster: who moves across the route no faster than this keeps its place there [m/s].

        Returns:
            A mask, shape (body,).
        """
        drift = np.where(np.abs(self.drift) > faster, self.drift, 0.0)
        reached = self.right + np.minimum(within * drift, 0.0) < high
        reached &= self.left + np.maximum(within * drift, 0.0) > low
        return np.asarray(reached)

    def only(self, rows: Array) -> "RoadUsers":
        """The road users in `rows`: their indices, shape (row,), or a mask, shape (body,)."""
        return rows_of(self, rows)
