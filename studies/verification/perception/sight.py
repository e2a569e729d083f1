"""Which vehicles a sensor sees: lines of sight to points on their bodies."""

from collections.abc import Sequence
from typing import Final

import numpy as np
import numpy.typing as npt

from studies.verification.perception.bodies import Prism, building_prism, vehicle_prisms
from studies.verification.perception.scene import Building, Float, Vehicle, corners
from studies.verification.perception.shadow import Sensor

Bool = npt.NDArray[np.bool_]

HEIGHTS: Final = (0.3, 0.6, 0.9)
"""Of the points that are looked at, in fractions of the height of the vehicle."""
SHARE: Final = 0.25
"""Of its points: if so many are in sight, the vehicle is seen."""


def seen_vehicles(
    sensor: Sensor, own: int, vehicles: Sequence[Vehicle], buildings: Sequence[Building]
) -> set[int]:
    """Ids of the vehicles that the sensor on vehicle `own` sees; `own` is not among them.

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
