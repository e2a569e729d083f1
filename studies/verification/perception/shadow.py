r"""Exact shadows on the ground: which of it a sensor sees.

A sensor stands at the height $h_s$ over the point $S$. A ground point $G$ is hidden by a prism over
the footprint $F$ between the heights $b$ and $t$ if the line of sight passes through it. At the
fraction $\tau$ of the way, it is at the height $h_s (1 - \tau)$, over the point
$S + \tau (G - S)$. So the shadow is

$$ \bigcup_{s_1 \le s \le s_2} S + s (F - S), \quad
   s_1 = \frac{h_s}{h_s - b}, \quad s_2 = \frac{h_s}{h_s - t} $$

the footprint, blown up about the sensor, swept from the one size to the other. It has no end if
$t \ge h_s$. Of a convex footprint it is the convex hull of its first and last size, since
$s f$ with $f$ in $F$ and $s$ in an interval is a convex set. Of any other it is the first size and
what the edges sweep: a point leaves the blown-up footprint over its border only.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final

import numpy as np
import shapely
from shapely.geometry import Point, Polygon
from shapely.geometry.base import BaseGeometry

from studies.verification.perception.bodies import Prism
from studies.verification.perception.scene import Float

_QUARTER_SEGMENTS: Final = 64
"""Sides of a circle per quarter; its area is short by 0.01 %."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Sensor:
    """Where a lidar stands, and how far it sees.

    Attributes:
        position: world frame [m].
        height: over the ground [m].
        range: largest distance of a point [m].
        depression: of the lowest channel [rad].
    """

    position: tuple[float, float]
    height: float
    range: float = 50.0
    depression: float = np.radians(20.0)

    @property
    def reach(self) -> float:
        """Radius of the ground within range [m]."""
        return float(np.sqrt(self.range**2 - self.height**2))

    @property
    def near(self) -> float:
        """Radius of the ground below the lowest channel [m]."""
        return float(self.height / np.tan(self.depression))

    @property
    def field(self) -> BaseGeometry:
        """The ring of ground that it sees if nothing hides it."""
        center = Point(self.position)
        inner = center.buffer(self.near, quad_segs=_QUARTER_SEGMENTS)
        return center.buffer(self.reach, quad_segs=_QUARTER_SEGMENTS).difference(inner)


def visible(sensor: Sensor, prisms: Iterable[Prism], ground: BaseGeometry) -> BaseGeometry:
    """The part of `ground` that `sensor` sees among `prisms`."""
    found = shapely.intersection(ground, sensor.field)
    return shapely.difference(found, shadow(sensor, prisms))


def shadow(sensor: Sensor, prisms: Iterable[Prism]) -> BaseGeometry:
    """The ground that `prisms` hide from `sensor`, within its range and some of it beyond.

    Raises:
        ValueError: the sensor stands on the border of a prism that reaches higher than it.
    """
    center = np.array(sensor.position)
    sweeps: dict[int, list[Float]] = {}
    others = []
    for prism in prisms:
        ring = prism.ring - center
        if prism.bottom >= sensor.height or not _is_within(ring, sensor.reach):
            continue
        first, last = _scales(prism, sensor, ring)
        if prism.is_convex:
            sweeps.setdefault(2 * len(ring), []).append(np.concatenate([ring * first, ring * last]))
            continue
        others.append(first * ring + center)
        ahead = np.roll(ring, -1, axis=0)
        edges = np.stack([ring * first, ahead * first, ring * last, ahead * last], axis=1)
        sweeps.setdefault(4, []).extend(edges)
    hulls = (
        hull
        for points in sweeps.values()
        for hull in shapely.convex_hull(shapely.multipoints(np.array(points) + center))
    )
    return shapely.union_all([*hulls, *map(Polygon, others)])


def _is_within(ring: Float, reach: float) -> bool:
    low, high = ring.min(axis=0), ring.max(axis=0)
    nearest = np.clip(0.0, low, high)
    return float(np.hypot(*nearest)) < reach


def _scales(prism: Prism, sensor: Sensor, ring: Float) -> tuple[float, float]:
    """First and last size of the shadow; the last is beyond the range if there is no end."""
    first = sensor.height / (sensor.height - prism.bottom)
    if prism.top < sensor.height:
        return first, sensor.height / (sensor.height - prism.top)
    distance = float(shapely.distance(Point(0.0, 0.0), shapely.linearrings(ring)))
    if distance == 0.0:
        raise ValueError("a sensor stands on the border of a prism that is higher")
    return first, max(first, 2 * sensor.reach / distance)
