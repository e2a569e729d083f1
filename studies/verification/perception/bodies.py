"""Everything that hides something, as prisms: the table of docs/physics-lidar.md, and buildings."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from shapely.geometry import Polygon

from studies.verification.perception.scene import Building, Float, Vehicle, corners

Part = tuple[float, float, float, float, float]

PARTS: Final[Sequence[Sequence[Part]]] = (
    ((-0.50, 0.50, 1.00, 0.00, 0.62), (-0.36, 0.16, 0.85, 0.62, 1.00)),
    ((-0.50, 0.50, 1.00, 0.00, 0.62), (-0.48, 0.20, 0.88, 0.62, 1.00)),
    ((-0.50, 0.50, 1.00, 0.00, 0.50), (-0.50, 0.36, 1.00, 0.50, 1.00)),
    ((-0.50, 0.50, 1.00, 0.00, 1.00),),
    (
        (-0.50, 0.50, 1.00, 0.00, 0.30),
        (0.28, 0.50, 1.00, 0.30, 0.90),
        (-0.50, 0.24, 1.00, 0.30, 1.00),
    ),
)
"""By the class of the body: rear, front (of the length), width, bottom, top (of the height)."""


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
    """The parts of a vehicle."""
    height = vehicle.size[2]
    return [
        Prism(corners(vehicle, (rear, front, width)), bottom * height, top * height, is_convex=True)
        for rear, front, width, bottom, top in PARTS[vehicle.body]
    ]


def building_prism(building: Building) -> Prism:
    """A building as a prism."""
    polygon = Polygon(building.ring)
    ring = np.array(building.ring, float)
    if not polygon.exterior.is_ccw:
        ring = ring[::-1]
    edge = np.roll(ring, -1, axis=0) - ring
    after = np.roll(edge, -1, axis=0)
    is_convex = bool((edge[:, 0] * after[:, 1] - edge[:, 1] * after[:, 0] >= 0).all())
    return Prism(ring, 0.0, building.height, is_convex)


def obstacles(vehicles: Iterable[Vehicle], buildings: Iterable[Building], own: int) -> list[Prism]:
    """Everything that can hide something from the sensor on vehicle `own`."""
    bodies = [part for one in vehicles if one.id != own for part in vehicle_prisms(one)]
    return [*bodies, *map(building_prism, buildings)]
