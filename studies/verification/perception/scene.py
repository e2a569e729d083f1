"""What stands and drives in one scene, as the inputs of the lidar FMU need it."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt
from shapely.geometry import Polygon

from orchestrator.signal import Signal

Float = npt.NDArray[np.float64]

MOUNT_HEIGHT: Final = 0.5
"""Height of every sensor over the roof of its vehicle [m]; the default of the lidar FMU."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Vehicle:
    """One vehicle, on the ground z = 0.

    Attributes:
        id: number, unique in the scene.
        position: centre of the footprint [m].
        heading: counter-clockwise from east [rad].
        size: length, width, height [m].
        body: a code of `fmus.messages.bodies.Body`.
    """

    id: int
    position: tuple[float, float]
    heading: float
    size: tuple[float, float, float]
    body: int

    @property
    def footprint(self) -> Polygon:
        """The rectangle that it stands on [m]."""
        return Polygon(corners(self, (-0.5, 0.5, 1.0)))

    @property
    def sensor_height(self) -> float:
        """Height of its lidar over the ground [m]."""
        return self.size[2] + MOUNT_HEIGHT


@dataclass(frozen=True, slots=True, kw_only=True)
class Building:
    """A prism over any simple polygon.

    Attributes:
        ring: corners [m], open.
        height: of the flat roof [m].
    """

    ring: Sequence[tuple[float, float]]
    height: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Scene:
    """A moment of traffic.

    Attributes:
        road: the drivable surface.
        buildings: beside it.
        vehicles: on it, by ascending id.
        ego: id of the ego vehicle.
        candidates: ids of the other vehicles that are equipped (lidar, radio), ascending.
        route: of the ego vehicle from its position on [m], shape (vertex, 2).
        description: in words.
    """

    road: Polygon
    buildings: Sequence[Building]
    vehicles: Sequence[Vehicle]
    ego: int
    candidates: Sequence[int]
    route: Float
    description: str

    @property
    def by_id(self) -> dict[int, Vehicle]:
        """The vehicles by their id."""
        return {vehicle.id: vehicle for vehicle in self.vehicles}

    @property
    def equipped(self) -> Sequence[int]:
        """The ids of the ego vehicle, then of the candidates."""
        return (self.ego, *self.candidates)

    def inputs(self) -> dict[str, Signal]:
        """Vehicles and buildings as inputs of the lidar FMU, by name."""
        cars, houses = self.vehicles, self.buildings
        owners = [k for k, house in enumerate(houses) for _ in house.ring]
        ring = [corner for house in houses for corner in house.ring]
        return {
            "vehicle.id": np.array([v.id for v in cars], np.int64),
            "vehicle.position": np.array([(*v.position, 0.0) for v in cars]).reshape(-1, 3),
            "vehicle.heading": np.array([v.heading for v in cars], float),
            "vehicle.size": np.array([v.size for v in cars], float).reshape(-1, 3),
            "vehicle.body": np.array([v.body for v in cars], np.int32),
            "vehicle.lidar": np.array([v.id in self.equipped for v in cars], np.bool_),
            "building.vertex": np.array(ring, float).reshape(-1, 2),
            "building.index": np.array(owners, np.int32),
            "building.height": np.array([house.height for house in houses], float),
        }


def corners(vehicle: Vehicle, part: tuple[float, float, float]) -> Float:
    """Find the corners of a part of the footprint in the world, counter-clockwise.

    Args:
        vehicle: whose.
        part: rear and front in fractions of its length, width in fractions of its width.

    Returns:
        Positions [m], shape (4, 2).
    """
    rear, front, width = part
    x = np.array([rear, front, front, rear]) * vehicle.size[0]
    y = np.array([-0.5, -0.5, 0.5, 0.5]) * width * vehicle.size[1]
    cosine, sine = np.cos(vehicle.heading), np.sin(vehicle.heading)
    turned = np.stack([cosine * x - sine * y, sine * x + cosine * y], axis=-1)
    found: Float = turned + np.array(vehicle.position)
    return found
