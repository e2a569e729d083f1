"""Vehicles and buildings as inputs of an FMU."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from orchestrator.signal import Array
from tests.fmus.driver import Library


@dataclass(frozen=True, slots=True, kw_only=True)
class Vehicle:
    """One vehicle; every member is an input of some FMU."""

    id: int
    position: tuple[float, float, float] = (0.0, 0.0, 0.0)
    heading: float = 0.0
    size: tuple[float, float, float] = (4.5, 1.8, 1.5)
    body: int = 0
    antenna_height: float = 1.55
    equipped: bool = True
    lidar: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Building:
    """One building."""

    ring: Sequence[tuple[float, float]]
    height: float = 10.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Scene:
    """What stands and drives there."""

    vehicles: Sequence[Vehicle] = ()
    buildings: Sequence[Building] = ()

    def lengths(self) -> dict[str, int]:
        """The values of the structural parameters, by name."""
        return {
            "n_vehicle": len(self.vehicles),
            "n_building": len(self.buildings),
            "n_building_vertex": sum(len(house.ring) for house in self.buildings),
        }

    def inputs(self, library: Library) -> dict[str, Array]:
        """The values of those inputs that the FMU has, by name."""
        cars, houses = self.vehicles, self.buildings
        corners = [corner for house in houses for corner in house.ring]
        owners = [k for k, house in enumerate(houses) for _ in house.ring]
        values: dict[str, Array] = {
            "vehicle.id": np.array([v.id for v in cars], np.int64),
            "vehicle.position": np.array([v.position for v in cars], float).reshape(-1, 3),
            "vehicle.heading": np.array([v.heading for v in cars], float),
            "vehicle.size": np.array([v.size for v in cars], float).reshape(-1, 3),
            "vehicle.body": np.array([v.body for v in cars], np.int32),
            "vehicle.antenna_height": np.array([v.antenna_height for v in cars], float),
            "vehicle.equipped": np.array([v.equipped for v in cars], np.bool_),
            "vehicle.lidar": np.array([v.lidar for v in cars], np.bool_),
            "building.vertex": np.array(corners, float).reshape(-1, 2),
            "building.index": np.array(owners, np.int32),
            "building.height": np.array([house.height for house in houses], float),
        }
        return {name: value for name, value in values.items() if name in library.variables}


def rectangle(x: float, y: float, length: float, width: float) -> tuple[tuple[float, float], ...]:
    """Corners of an upright rectangle around (x, y), counter-clockwise [m]."""
    a, b = length / 2, width / 2
    return ((x - a, y - b), (x + a, y - b), (x + a, y + b), (x - a, y + b))
