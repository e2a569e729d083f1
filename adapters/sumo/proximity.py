"""How close the ego vehicle came to another one, between two states of the traffic."""

import math
from dataclasses import dataclass
from typing import Final, TypeAlias

import numpy as np
import numpy.typing as npt

from adapters.sumo.population import Poses
from adapters.traffic.geometry import Boxes, Float, box_distance, wrap

Integers: TypeAlias = npt.NDArray[np.int64]

NOBODY_NEAR: Final = 1000.0
"""The gap [m] reported when there is no other vehicle."""


@dataclass(frozen=True, slots=True)
class Contact:
    """The first overlap.

    Attributes:
        instant: the index of the first instant at which bodies overlap.
        vehicle: number of the other one; of several the lowest.
    """

    instant: int
    vehicle: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Closest:
    """The smallest distance.

    Attributes:
        gap: between the bodies [m], 0 if they overlap.
        vehicle: number of the other one; -1 if there is none.
        contact: where they overlap, the first time that anybody does.
    """

    gap: float
    vehicle: int
    contact: Contact | None = None

    def or_closer(self, other: "Closest") -> "Closest":
        """The smaller one of both, this one if they are equal."""
        return other if other.gap < self.gap else self


NOBODY: Final = Closest(gap=NOBODY_NEAR, vehicle=-1)


def closest_approach(
    track: Float, ego_size: Float, *, number: Integers, size: Float, a: Poses, b: Poses
) -> Closest:
    """The smallest distance between the ego's body and others that move from `a` to `b`.

    Others move along straight lines and turn evenly. Exact at the instants looked at.

    Args:
        track: centre x, y [m] and heading [rad] of the ego's body at n > 0 instants, evenly
            spread from just after `a` to `b`; shape (n, 3).
        ego_size: length and width of the ego [m], shape (2,).
        number: of the others, shape (vehicle,).
        size: length and width [m] of the others, shape (vehicle, 2).
        a: poses of the others at the beginning.
        b: poses of the same vehicles at the end.
    """
    if len(size) == 0:
        return NOBODY
    fraction = np.arange(1, len(track) + 1)[:, None] / len(track)  # (n, 1)
    center = a.center + fraction[..., None] * (b.center - a.center)  # (n, vehicle, 2)
    between = center - track[:, None, :2]
    apart = np.hypot(between[..., 0], between[..., 1])
    reach = 0.5 * (np.hypot(size[:, 0], size[:, 1]) + math.hypot(*ego_size.tolist()))
    rows = np.flatnonzero((apart - reach).min(axis=0) <= apart.min())  # the others are farther
    heading = a.heading[rows] + fraction * wrap(b.heading[rows] - a.heading[rows])
    distance = box_distance(
        Boxes(center=track[:, None, :2], heading=track[:, None, 2], size=ego_size),
        Boxes(center=center[:, rows], heading=heading, size=size[rows]),
    )  # (n, near)
    smallest = distance.min(axis=0)
    nearest = int(np.argmin(smallest))
    gap = float(smallest[nearest])
    if gap >= NOBODY_NEAR:
        return NOBODY
    contact = _contact(distance, number[rows]) if gap <= 0.0 else None
    return Closest(gap=gap, vehicle=int(number[rows[nearest]]), contact=contact)


def _contact(distance: Float, number: Integers) -> Contact:
    """The first overlap in `distance`, shape (n, vehicle), which has one."""
    overlap = distance <= 0.0
    instant = int(np.argmax(overlap.any(axis=1)))
    return Contact(instant, int(number[overlap[instant]].min()))
