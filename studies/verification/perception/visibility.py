r"""What a lidar sees: the ground by exact shadows, vehicles by lines of sight.

Everything that hides something is a prism: parts of bodies (the table of docs/physics-lidar.md) and
buildings.

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

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt
import shapely
from shapely.geometry import Point, Polygon
from shapely.geometry.base import BaseGeometry

from studies.verification.perception.scene import Building, Float, Vehicle, corners


@dataclass(frozen=True, slots=True)
class Part:
    """A box that is part of a vehicle's body, in fractions of the whole.

    Attributes:
        rear, front: of the length, from the middle.
        width: of the width.
        bottom, top: of the height.
    """

    rear: float
    front: float
    width: float
    bottom: float
    top: float


PARTS: Final[Sequence[Sequence[Part]]] = (
    (Part(-0.50, 0.50, 1.00, 0.00, 0.62), Part(-0.36, 0.16, 0.85, 0.62, 1.00)),
    (Part(-0.50, 0.50, 1.00, 0.00, 0.62), Part(-0.48, 0.20, 0.88, 0.62, 1.00)),
    (Part(-0.50, 0.50, 1.00, 0.00, 0.50), Part(-0.50, 0.36, 1.00, 0.50, 1.00)),
    (Part(-0.50, 0.50, 1.00, 0.00, 1.00),),
    (
        Part(-0.50, 0.50, 1.00, 0.00, 0.30),
        Part(0.28, 0.50, 1.00, 0.30, 0.90),
        Part(-0.50, 0.24, 1.00, 0.30, 1.00),
    ),
    (
        Part(-0.49, 0.49, 0.85, 0.00, 0.12),
        Part(-0.50, 0.50, 1.00, 0.12, 0.88),
        Part(-0.45, 0.45, 0.70, 0.88, 1.00),
    ),
    (
        Part(-0.50, 0.50, 0.35, 0.00, 0.53),
        Part(-0.15, 0.15, 0.65, 0.18, 0.53),
        Part(-0.20, 0.18, 0.60, 0.53, 0.83),
        Part(-0.02, 0.12, 0.28, 0.83, 1.00),
    ),
    (
        Part(-0.50, 0.50, 0.12, 0.00, 0.41),
        Part(-0.15, 0.15, 0.55, 0.06, 0.56),
        Part(-0.20, 0.22, 0.75, 0.56, 0.84),
        Part(0.05, 0.20, 0.25, 0.84, 1.00),
    ),
    (
        Part(-0.50, 0.50, 0.70, 0.00, 0.48),
        Part(-0.50, 0.50, 1.00, 0.48, 0.82),
        Part(-0.45, 0.45, 0.32, 0.82, 1.00),
    ),
)
"""Parts of bodies by their class, as docs/physics-lidar.md lists them."""


@dataclass(frozen=True, slots=True)
class Prism:
    """An upright prism.

    Attributes:
        ring: corners [m], counter-clockwise, shape (corner, 2).
        bottom, top: heights over the ground [m].
        is_convex: whether the ring is.
    """

    ring: Float
    bottom: float
    top: float
    is_convex: bool


def vehicle_prisms(vehicle: Vehicle) -> list[Prism]:
    """Turn a vehicle into the prisms of its parts."""
    height = vehicle.size[2]
    return [
        Prism(
            corners(vehicle, (part.rear, part.front, part.width)),
            part.bottom * height,
            part.top * height,
            is_convex=True,
        )
        for part in PARTS[vehicle.body]
    ]


def building_prism(building: Building) -> Prism:
    """Turn a building into a prism."""
    polygon = Polygon(building.ring)
    ring = np.array(building.ring, float)
    if not polygon.exterior.is_ccw:
        ring = ring[::-1]
    edge = np.roll(ring, -1, axis=0) - ring
    after = np.roll(edge, -1, axis=0)
    is_convex = bool((edge[:, 0] * after[:, 1] - edge[:, 1] * after[:, 0] >= 0).all())
    return Prism(ring, 0.0, building.height, is_convex)


def obstacles(vehicles: Iterable[Vehicle], buildings: Iterable[Building], own: int) -> list[Prism]:
    """Collect everything that can hide something from the sensor on vehicle `own`."""
    bodies = [part for one in vehicles if one.id != own for part in vehicle_prisms(one)]
    return [*bodies, *map(building_prism, buildings)]


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
        """The ring of ground that it sees if nothing hides it [m]."""
        center = Point(self.position)
        inner = center.buffer(self.near, quad_segs=_QUARTER_SEGMENTS)
        return center.buffer(self.reach, quad_segs=_QUARTER_SEGMENTS).difference(inner)


def visible(sensor: Sensor, prisms: Iterable[Prism], ground: BaseGeometry) -> BaseGeometry:
    """Find the part of `ground` that `sensor` sees among `prisms`."""
    found = shapely.intersection(ground, sensor.field)
    return shapely.difference(found, shadow(sensor, prisms))


def shadow(sensor: Sensor, prisms: Iterable[Prism]) -> BaseGeometry:
    """Find the ground that `prisms` hide from `sensor`, within its range and some of it beyond.

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


Bool = npt.NDArray[np.bool_]

HEIGHTS: Final = (0.3, 0.6, 0.9)
"""Heights of the points that are looked at, in fractions of the height of the vehicle."""
SHARE: Final = 0.25
"""Share of the points of a vehicle that are in sight if it is seen, at least."""


def seen_vehicles(
    sensor: Sensor, own: int, vehicles: Sequence[Vehicle], buildings: Sequence[Building]
) -> set[int]:
    """Find the vehicles that the sensor on vehicle `own` sees: ids, without `own`.

    Looked at are the corners of the footprint and the middles of its sides at three heights. A
    vehicle does not hide itself, but others and buildings do, and so does the end of the range.
    Unlike the ground next to it, the upper part of a vehicle shows over lower ones.
    """
    others = [one for one in vehicles if one.id != own]
    if not others:
        return set()
    points = np.stack([_points(one) for one in others])  # (vehicle, point, 3)
    origin = np.array([*sensor.position, sensor.height])
    ray = points - origin
    free = np.linalg.norm(ray, axis=-1) <= sensor.range
    for k, one in enumerate(others):
        for part in vehicle_prisms(one):
            if not _is_far(part, sensor):
                hit = _crosses_convex(origin, ray, part)
                hit[k] = False
                free &= ~hit
    for building in buildings:
        prism = building_prism(building)
        if not _is_far(prism, sensor):
            free &= ~_crosses_walls(origin, ray, prism)
    share = free.mean(axis=1)
    return {one.id for one, seen in zip(others, share, strict=True) if seen >= SHARE}


def _points(vehicle: Vehicle) -> Float:
    ring = corners(vehicle, (-0.5, 0.5, 1.0))
    around = np.concatenate([ring, (ring + np.roll(ring, -1, axis=0)) / 2])
    levels = [np.column_stack([around, np.full(8, z * vehicle.size[2])]) for z in HEIGHTS]
    return np.concatenate(levels)


def _is_far(prism: Prism, sensor: Sensor) -> bool:
    distance = np.linalg.norm(prism.ring - np.array(sensor.position), axis=1)
    side = np.linalg.norm(prism.ring - np.roll(prism.ring, -1, axis=0), axis=1)
    return bool(distance.min() > sensor.range + side.max())


def _crosses_convex(origin: Float, ray: Float, prism: Prism) -> Bool:
    """Whether segments from `origin` along `ray`, shape (..., 3), pass through; shape (...)."""
    edge = np.roll(prism.ring, -1, axis=0) - prism.ring
    inwards = np.stack([-edge[:, 1], edge[:, 0]], axis=1)
    start = ((origin[:2] - prism.ring) * inwards).sum(axis=1)
    slope = ray[..., :2] @ inwards.T  # (..., side)
    heights = np.array([origin[2] - prism.bottom, prism.top - origin[2]])
    start = np.concatenate([start, heights])
    slope = np.concatenate([slope, ray[..., 2:], -ray[..., 2:]], axis=-1)
    with np.errstate(divide="ignore", invalid="ignore"):
        at = -start / slope
    enters = np.where(slope > 0, at, 0.0).max(axis=-1)
    leaves = np.where(slope < 0, at, 1.0).min(axis=-1)
    outside = ((slope == 0) & (start < 0)).any(axis=-1)
    found: Bool = (enters < leaves) & (enters < 1.0) & (leaves > 0.0) & ~outside
    return found


def _crosses_walls(origin: Float, ray: Float, prism: Prism) -> Bool:
    """Whether segments pass through a wall of a prism that stands on the ground."""
    found = np.zeros(ray.shape[:-1], np.bool_)
    for corner, after in zip(prism.ring, np.roll(prism.ring, -1, axis=0), strict=True):
        edge, offset = after - corner, corner - origin[:2]
        across = ray[..., 0] * edge[1] - ray[..., 1] * edge[0]
        with np.errstate(divide="ignore", invalid="ignore"):
            along_ray = (offset[0] * edge[1] - offset[1] * edge[0]) / across
            along_edge = (offset[0] * ray[..., 1] - offset[1] * ray[..., 0]) / across
        height = origin[2] + along_ray * ray[..., 2]
        hit = (along_ray >= 0) & (along_ray <= 1) & (along_edge >= 0) & (along_edge <= 1)
        found |= hit & (height <= prism.top) & (height >= prism.bottom)
    return found
