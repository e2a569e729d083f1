"""Which part of the ego's route other vehicles take up, and when, if they keep their velocities."""

from dataclasses import dataclass
from typing import Final

import numpy as np

from fmus.driving.policy.route import Box, Segments
from fmus.messages.columns import rows_of
from fmus.physics.boxes import corners
from orchestrator.signal import Array

_SIGNS: Final = np.array([[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]])
"""Front left, rear left, rear right, front right."""
_PARALLEL: Final = 1e-12
"""Stands for no difference at all [m], where one divides by it."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Vehicles:
    """Vehicles with oriented boxes as bodies.

    Attributes:
        number: int64, (vehicle,).
        center: of the body [m], (vehicle, 2).
        heading: of its length, counter-clockwise from east [rad], (vehicle,).
        size: length and width [m], (vehicle, 2).
        velocity: [m/s], (vehicle, 2).
    """

    number: Array
    center: Array
    heading: Array
    size: Array
    velocity: Array

    def only(self, rows: Array) -> "Vehicles":
        """The vehicles in `rows`: their indices, shape (row,), or a mask, shape (vehicle,)."""
        return rows_of(self, rows)

    def corners(self) -> Array:
        """The corners of the bodies [m], shape (vehicle, 4, 2), in a walk around each."""
        return corners(self.center, self.heading, self.size)


def others(vehicles: Vehicles, ego: int) -> Vehicles:
    """All vehicles but the ego.

    Args:
        vehicles: all of them.
        ego: number of the ego, -1 once it has left.

    Raises:
        ValueError: the ego is not among them, so that they cannot be all.
    """
    if ego >= 0 and ego not in vehicles.number:
        raise ValueError(
            f"the ego vehicle, `ego.id` {ego}, is not among the {len(vehicles.number)} vehicles of "
            "`vehicle.id`; connect the truth about all vehicles, for example "
            "`{from: traffic.vehicle, to: policy.vehicle}`"
        )
    return vehicles.only(vehicles.number != ego)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Occupancy:
    """What vehicles take up of a strip along the route.

    Attributes:
        rear, front: where the part of each body within the strip begins and ends along the route
            at each time [m], (vehicle, time); infinite and minus infinite where there is none.
        pace: with which each gets ahead along the route [m/s], not negative, (vehicle,).
    """

    rear: Array
    front: Array
    pace: Array


def reaching(vehicles: Vehicles, times: Array, place: Box) -> Array:
    """Which vehicles may reach a box at one of several times; nobody else does.

    It is a cheap selection, before `occupancy`.

    Args:
        vehicles: at the time 0.
        times: [s], shape (time,).
        place: the box.

    Returns:
        A mask, shape (vehicle,).
    """
    around = 0.5 * np.hypot(*vehicles.size.T)[:, None, None]
    center = vehicles.center[:, None] + times[:, None] * vehicles.velocity[:, None]
    inside = (center >= place.lower - around) & (center <= place.upper + around)
    return np.asarray(inside.all(axis=-1).any(axis=-1))


def occupancy(line: Segments, vehicles: Vehicles, times: Array, side: float) -> Occupancy:
    """What each vehicle takes up of the strip of `side` [m] on both sides of the route.

    Exact where the route is straight. Where it bends, the edges of a body are taken for straight
    in the coordinates along and across it.

    Args:
        line: the route.
        vehicles: at the first of the times.
        times: at which [s], shape (time,), at least two.
        side: half the width of the strip [m].
    """
    moved = times[:, None] * vehicles.velocity[:, None]  # (vehicle, time, 2)
    along, across = line.project(vehicles.corners()[:, None] + moved[:, :, None])
    rear, front = _within(along, across, side)
    step = np.stack([vehicles.center, vehicles.center + times[1] * vehicles.velocity])
    before, after = line.project(step)[0]
    return Occupancy(rear=rear, front=front, pace=np.maximum(after - before, 0.0) / times[1])


def _within(along: Array, across: Array, side: float) -> tuple[Array, Array]:
    """The smallest and largest `along` of polygons' parts with |across| <= `side`.

    A strip has no ends: of the border of a polygon that meets it, some part lies within it. So
    each edge is cut to the strip, as Liang and Barsky cut lines (ACM Trans. Graph. 3, 1984).

    Args:
        along: of the corners [m], (..., corner).
        across: of the same.
        side: [m].

    Returns:
        Both, (...); infinite and minus infinite for polygons outside.
    """
    length = np.roll(along, -1, axis=-1) - along
    climb = np.roll(across, -1, axis=-1) - across
    climb = np.where(np.abs(climb) < _PARALLEL, _PARALLEL, climb)
    one, other = (-side - across) / climb, (side - across) / climb
    first = np.maximum(np.minimum(one, other), 0.0)
    last = np.minimum(np.maximum(one, other), 1.0)
    meets = first <= last
    ends = np.stack([along + first * length, along + last * length])
    rear = np.where(meets, ends.min(axis=0), np.inf).min(axis=-1)
    front = np.where(meets, ends.max(axis=0), -np.inf).max(axis=-1)
    return rear, front
