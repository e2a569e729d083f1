r"""Paths beside the centre line of a lane: from one lateral offset to another.

The offset is a polynomial of the fifth degree in the way, which is the one of least jerk between
two offsets that are kept (A. Takahashi et al., Local path planning and motion control for AGV in
positioning, IROS 1989). Over a way $L$ it changes by $\Delta$ with the largest slope
$\frac{15}{8} \Delta / L$, in the middle, and the largest curvature
$\frac{10}{\sqrt 3} \Delta / L^2$.
"""

import math
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from fmus.driving.policy.route import Segments
from orchestrator.signal import Array

LARGEST_CURVATURE: Final = 10.0 / math.sqrt(3.0)
"""The largest curvature of a change of the offset by 1 over a way of 1."""
LARGEST_SLOPE: Final = 15.0 / 8.0
"""The largest slope of the same change."""
_STEEPEST: Final = 0.5
"""Slope that a change is never planned to exceed: 27 degrees to the lane."""
_SPACING: Final = 1.0
"""Vertices of a path beside a lane are so far apart [m]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LaneChange:
    """The lateral offset along the way, from a start on.

    Attributes:
        begin: of the change, on the way [m].
        length: of the change, positive [m].
        start, end: offsets before and after [m].
        slope: of the offset at the beginning.
        curvature: of the offset at the beginning [1/m].
    """

    begin: float
    length: float
    start: float
    end: float
    slope: float = 0.0
    curvature: float = 0.0

    def offset(self, way: Array) -> Array:
        """The offset [m] at places on the way [m], of the same shape."""
        u = np.clip((way - self.begin) / self.length, 0.0, 1.0)
        value: Array = np.polynomial.polynomial.polyval(u, self._coefficients())
        return value

    def at(self, way: float) -> "tuple[float, float, float]":
        """Offset [m], slope and curvature [1/m] at a place on the way [m]."""
        u = (way - self.begin) / self.length
        if u >= 1.0:
            return self.end, 0.0, 0.0
        c0, c1, c2, c3, c4, c5 = self._coefficients()
        offset = c0 + u * (c1 + u * (c2 + u * (c3 + u * (c4 + u * c5))))
        slope = c1 + u * (2 * c2 + u * (3 * c3 + u * (4 * c4 + u * 5 * c5)))
        curvature = 2 * c2 + u * (6 * c3 + u * (12 * c4 + u * 20 * c5))
        return offset, slope / self.length, curvature / self.length**2

    def towards(self, end: float, way: float, length: float) -> "LaneChange":
        """The change that goes on from a place on the way of this one, smoothly, to another end.

        Args:
            end: the offset there [m].
            way: where it begins [m].
            length: of the new change [m].
        """
        offset, slope, curvature = self.at(way)
        return LaneChange(
            begin=way, length=length, start=offset, end=end, slope=slope, curvature=curvature
        )

    def mirrored(self) -> "LaneChange":
        """This change, to the other side."""
        return replace(
            self,
            start=-self.start,
            end=-self.end,
            slope=-self.slope,
            curvature=-self.curvature,
        )

    def is_over(self, way: float) -> bool:
        """Whether the offset stays what it is from this place on [m]."""
        return way >= self.begin + self.length

    def _coefficients(self) -> "tuple[float, ...]":
        """Coefficients of the polynomial in the share of the way, without slope at its end."""
        first = self.slope * self.length
        second = 0.5 * self.curvature * self.length**2
        missing = self.end - self.start - first - second
        tilt, bend = -first - 2.0 * second, -2.0 * second
        return (
            self.start,
            first,
            second,
            10.0 * missing - 4.0 * tilt + 0.5 * bend,
            -15.0 * missing + 7.0 * tilt - bend,
            6.0 * missing - 3.0 * tilt + 0.5 * bend,
        )


def length_of_change(offset: float, speed: float, lateral_acceleration: float) -> float:
    r"""The way that a change of the offset takes, $v \sqrt{10 |\Delta| / (\sqrt 3\, a)}$.

    It is longer where it would be steeper than 27 degrees otherwise: at walking pace.

    Args:
        offset: by which it changes [m].
        speed: the highest on the way [m/s].
        lateral_acceleration: the largest [m/s^2].

    Returns:
        The way [m], positive.
    """
    gentle = speed * math.sqrt(LARGEST_CURVATURE * abs(offset) / lateral_acceleration)
    return max(gentle, LARGEST_SLOPE * abs(offset) / _STEEPEST, _SPACING)


def beside(route: Array, change: LaneChange, way: float) -> Array:
    """The path beside a route, or the route itself where no offset is left.

    Args:
        route: centre line from the vehicle on [m], (vertex, 2); no two vertices are equal
            throughout.
        change: the offset, left positive.
        way: that the vehicle has come, to which the route's first vertex belongs [m].

    Returns:
        Vertices [m], shape (vertex, 2), at most 1 m apart, but for rounding.
    """
    if change.is_over(way) and change.end == 0.0:
        return route
    line = Segments.of(route)
    total = float(line.begin[-1] + line.length[-1])
    along = np.linspace(0.0, total, max(math.ceil(total / _SPACING), 1) + 1)
    part = np.searchsorted(line.begin, along, side="right") - 1
    points = line.start[part] + (along - line.begin[part])[:, None] * line.direction[part]
    tangent = np.gradient(points, axis=0)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    left = np.column_stack([-tangent[:, 1], tangent[:, 0]])
    path: Array = points + change.offset(way + along)[:, None] * left
    return path
