"""The route of the ego vehicle and parts of it."""

from dataclasses import dataclass
from typing import Final

import numpy as np

from orchestrator.signal import Array

ROUNDING: Final = 0.01
"""Far above the rounding errors of a projection [m]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Box:
    """A box along the world's axes: lower and upper corner [m], (2,) each."""

    lower: Array
    upper: Array


@dataclass(frozen=True, slots=True, kw_only=True)
class Segments:
    """The straight parts of a route, one after the other.

    Attributes:
        start: [m], (segment, 2).
        direction: unit vectors, (segment, 2).
        begin: distance of the start along the route [m], (segment,).
        length: [m], (segment,), positive.
    """

    start: Array
    direction: Array
    begin: Array
    length: Array

    @classmethod
    def of(cls, route: Array) -> "Segments":
        """The segments between the vertices of a route.

        Args:
            route: [m], shape (vertex, 2); equal vertices, one after the other, make no segment.
        """
        start, edge = route[:-1], route[1:] - route[:-1]
        length = np.linalg.norm(edge, axis=1)
        if not length.all():
            start, edge, length = start[length > 0], edge[length > 0], length[length > 0]
        begin = np.concatenate([[0.0], np.cumsum(length)[:-1]])
        return cls(start=start, direction=edge / length[:, None], begin=begin, length=length)

    def project(self, points: Array) -> tuple[Array, Array]:
        """Distance along the segments and signed distance across them (left positive).

        The first and last segments are continued; see `fmus.driving.policy.conflict.project`.

        Args:
            points: [m], shape (..., 2).

        Returns:
            Along and across [m], each of the shape of `points` without its last axis.
        """
        x, y = points[..., 0].reshape(-1), points[..., 1].reshape(-1)
        start_x, start_y = self.start[:, :1], self.start[:, 1:]
        dx, dy = self.direction[:, :1], self.direction[:, 1:]
        offset_x, offset_y = x - start_x, y - start_y  # (segment, point)
        lower, upper = np.zeros_like(self.length), self.length.copy()
        lower[0], upper[-1] = -np.inf, np.inf
        clipped = (offset_x * dx + offset_y * dy).clip(lower[:, None], upper[:, None])
        apart_x, apart_y = x - (start_x + clipped * dx), y - (start_y + clipped * dy)
        distance = np.sqrt(apart_x * apart_x + apart_y * apart_y)
        nearest = distance.argmin(axis=0), np.arange(len(x))
        side = dx * offset_y - dy * offset_x
        along = self.begin[nearest[0]] + clipped[nearest]
        across = np.copysign(distance[nearest], side[nearest])
        return along.reshape(points.shape[:-1]), across.reshape(points.shape[:-1])

    def at(self, distance: float) -> Array:
        """The point [m], shape (2,), at `distance` [m] along the route, which goes on straight."""
        part = max(int(np.searchsorted(self.begin, distance, side="right")) - 1, 0)
        point: Array = self.start[part] + (distance - self.begin[part]) * self.direction[part]
        return point

    def box(self, first: float, last: float, side: float) -> "Box":
        """The box around what lies within `side` of the route from `first` to `last` along it [m].

        It is a little larger, so that rounding errors of `project` put nothing out of it.
        """
        lower = np.maximum(self.begin, first)
        upper = np.minimum(self.begin + self.length, last)
        lower[0], upper[-1] = first, last
        part = lower <= upper
        ends = np.array([lower, upper])[:, part] - self.begin[part]  # (2, segment)
        points = self.start[part] + ends[..., None] * self.direction[part]
        margin = side + ROUNDING
        return Box(lower=points.min(axis=(0, 1)) - margin, upper=points.max(axis=(0, 1)) + margin)
