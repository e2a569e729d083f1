"""Vehicles and buildings as inputs of an FMU."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from fmus.messages.bodies import Body
from orchestrator.signal import Array
from tests.fmus.driver import Library

SIZES: Final[Mapping[Body, tuple[float, float, float]]] = {
    Body.CAR: (4.5, 1.8, 1.5),
    Body.SUV: (4.7, 1.9, 1.8),
    Body.VAN: (5.9, 2.0, 2.5),
    Body.BUS: (12.0, 2.5, 3.2),
    Body.TRUCK: (10.0, 2.5, 3.8),
    Body.RAIL: (22.0, 2.4, 3.2),
    Body.MOTORCYCLE: (2.2, 0.9, 1.5),
    Body.BICYCLE: (1.6, 0.65, 1.7),
    Body.PEDESTRIAN: (0.215, 0.478, 1.719),
}
"""Length, width, height of common ones [m]; from the tram on the defaults of SUMO's classes."""


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
