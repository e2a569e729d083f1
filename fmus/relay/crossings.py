"""Where hops run over bodies and through walls, for many hops at once."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fmus.physics.boxes import in_boxes
from fmus.relay.nodes import Node
from fmus.relay.obstacles import Obstacles
from orchestrator.signal import Array


@dataclass(frozen=True, slots=True, kw_only=True)
class Hops:
    """Pairs of radios.

    Attributes:
        vehicle: both ends, int64 (hop, 2).
        start: antenna of one end, x, y and height [m], (..., hop, 3).
        end: antenna of the other end [m], (..., hop, 3).
    """

    vehicle: Array
    start: Array
    end: Array

    @classmethod
    def between(cls, pairs: Sequence[tuple[Node, Node]]) -> "Hops":
        """The hops between radios where they are now."""
        first, second = [pair[0] for pair in pairs], [pair[1] for pair in pairs]
        return cls(
            vehicle=np.stack([vehicles(first), vehicles(second)], axis=1),
            start=antennas(first),
            end=antennas(second),
        )

    def own(self, owner: Array) -> Array:
        """Whether a body carries one of the two antennas, bool, shape (hop, obstacle).

        Args:
            owner: the vehicle of each body, int64, shape (obstacle,).
        """
        first, second = self.vehicle[:, :1], self.vehicle[:, 1:]
        return np.asarray((owner == first) | (owner == second))


def vehicles(nodes: Sequence[Node]) -> Array:
    """The numbers of the nodes, int64, shape (node,)."""
    return np.array([node.vehicle for node in nodes], np.int64)


def antennas(nodes: Sequence[Node]) -> Array:
    """Where the antennas of the nodes are now: x, y and height [m], shape (node, 3)."""
    places = [(*node.position, node.antenna_height) for node in nodes]
    return np.array(places, np.float64).reshape(-1, 3)


@dataclass(frozen=True, slots=True, kw_only=True)
class Crossings:
    """The hops that run over obstacles; every array has one entry per crossing.

    Attributes:
        hop: index into the hops, flattened.
        obstacle: index into the obstacles.
        middle: fraction of the hop, from its start, at the middle of the crossing.
    """

    hop: Array
    obstacle: Array
    middle: Array


def crossings(hops: Hops, obstacles: Obstacles, center: Array | None = None) -> Crossings:
    """Which hops run over which bodies, by ascending hop and then obstacle.

    The bodies that carry the antennas are passed over.

    Args:
        hops: at one instant, or several: shape (..., hop).
        obstacles: the bodies.
        center: of the bodies at each instant [m], shape (..., obstacle, 2); `None`: as they are
            now.
    """
    places = obstacles.center if center is None else center
    start, along = hops.start[..., :2], hops.end[..., :2] - hops.start[..., :2]
    near = _near(start, along, places, np.sum(obstacles.half**2, axis=-1))
    near &= ~hops.own(obstacles.owner)
    *instant, hop, body = np.nonzero(near)
    first = start[(*instant, hop)]
    step = along[(*instant, hop)]
    box = (places[(*instant, body)], obstacles.heading[body])
    enter, leave = _span(in_boxes(first, *box), in_boxes(first + step, *box), obstacles.half[body])
    crosses = enter < leave
    flat = np.ravel_multi_index((*instant, hop), start.shape[:-1])
    middle = (enter[crosses] + leave[crosses]) / 2.0
    return Crossings(hop=flat[crosses], obstacle=body[crosses], middle=middle)


def _near(start: Array, along: Array, center: Array, square: Array) -> Array:
    """Whether the circle around a body touches the line and the box around the hop."""
    x, y = (center[..., None, :, k] - start[..., k, None] for k in (0, 1))
    dx, dy = along[..., 0, None], along[..., 1, None]
    length = dx * dx + dy * dy
    reach = np.sqrt(square * length)
    across = dx * y
    across -= dy * x
    near = np.abs(across, out=across) <= reach
    near &= length > 0.0
    x *= dx
    y *= dy
    x += y
    near &= x >= -reach
    reach += length
    near &= x <= reach
    return np.asarray(near)


def _span(first: Array, last: Array, half: Array) -> tuple[Array, Array]:
    """The fractions between which segments run over boxes in whose frames they are given."""
    step = last - first
    with np.errstate(divide="ignore", invalid="ignore"):
        one, other = (-half - first) / step, (half - first) / step
    inside = np.where(np.abs(first) <= half, np.inf, -np.inf)
    enter = np.where(step == 0.0, -inside, np.minimum(one, other))
    leave = np.where(step == 0.0, inside, np.maximum(one, other))
    first_in = np.maximum(np.maximum(enter[..., 0], enter[..., 1]), 0.0)
    first_out = np.minimum(np.minimum(leave[..., 0], leave[..., 1]), 1.0)
    return np.asarray(first_in), np.asarray(first_out)


@dataclass(frozen=True)
class Walls:
    """The walls of buildings, as the ego's map has them.

    Attributes:
        vertex: corners of the rings [m], (corner, 2).
        index: the building of each corner, ascending, (corner,).
    """

    vertex: Array
    index: Array

    @cached_property
    def _edges(self) -> tuple[Array, Array, Array]:
        """First corner and step of each wall, and +1 where its ring runs counter-clockwise."""
        if len(self.index) == 0:
            return np.empty((0, 2)), np.empty((0, 2)), np.empty(0)
        following = np.arange(1, len(self.index) + 1)
        last = np.append(self.index[1:] != self.index[:-1], [True])
        following[last] = np.searchsorted(self.index, self.index)[last]
        step = self.vertex[following] - self.vertex
        twice_area = _cross(self.vertex, step)
        sense = np.sign(np.bincount(self.index, twice_area)[self.index])
        return self.vertex, step, sense

    def cuts(self, start: Array, end: Array) -> tuple[Array, Array]:
        """How many walls segments cross, and how far they run inside buildings.

        Both ends are outside, as those of radios on roads are.

        Args:
            start: where the segments begin, x and y [m], shape (..., 2).
            end: where they end, x and y [m], shape (..., 2).

        Returns:
            The number of walls, int64, and the fraction of the segment that is inside, each of
            shape (...,).
        """
        shape = start.shape[:-1]
        start, end = start.reshape(-1, 2), end.reshape(-1, 2)
        count, inside = np.zeros(len(start), np.int64), np.zeros(len(start))
        near = np.flatnonzero(self._reach(start, end))
        count[near], inside[near] = self._cuts(start[near], end[near])
        return count.reshape(shape), inside.reshape(shape)

    def _reach(self, start: Array, end: Array) -> Array:
        """Whether the box around a segment meets the box around any building, (n,)."""
        lower, upper = self._boxes
        low, high = np.minimum(start, end), np.maximum(start, end)
        meet = np.ones((len(start), len(lower)), np.bool_)
        for axis in (0, 1):
            meet &= low[:, axis, None] <= upper[:, axis]
            meet &= high[:, axis, None] >= lower[:, axis]
        return np.asarray(meet.any(axis=1))

    @cached_property
    def _boxes(self) -> tuple[Array, Array]:
        """Lower and upper corner of the box around each building [m], (building, 2)."""
        first = np.flatnonzero(np.append([True], self.index[1:] != self.index[:-1]))
        if len(self.index) == 0:
            return np.empty((0, 2)), np.empty((0, 2))
        lower = np.minimum.reduceat(self.vertex, first, axis=0)
        return lower, np.maximum.reduceat(self.vertex, first, axis=0)

    def _cuts(self, start: Array, end: Array) -> tuple[Array, Array]:
        corner, edge, sense = self._edges
        along = (end - start)[:, None, :]
        offset = corner - start[:, None, :]
        cross = _cross(along, edge)
        with np.errstate(divide="ignore", invalid="ignore"):
            on_link = _cross(offset, edge) / cross
            on_wall = _cross(offset, along) / cross
        hit = (cross != 0) & (on_link > 0) & (on_link < 1) & (on_wall >= 0) & (on_wall < 1)
        leaving = np.sign(cross) * sense
        inside = np.sum(leaving * np.where(hit, on_link, 0.0), axis=-1)
        return np.count_nonzero(hit, axis=-1), inside


def _cross(a: Array, b: Array) -> Array:
    return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])
