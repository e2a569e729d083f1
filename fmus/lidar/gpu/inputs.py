"""What the lidar reads."""

from dataclasses import dataclass
from typing import Self

import numpy as np
import numpy.typing as npt

from orchestrator.signal import Signals


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Inputs:
    """The scene at one communication point.

    Attributes:
        id: numbers of the vehicles, ascending, int64, shape (vehicle,).
        position: centres of the footprints, world frame [m], float64, shape (vehicle, 3).
        heading: counter-clockwise from the x axis [rad], float64, shape (vehicle,).
        size: length, width and height of the bodies [m], float64, shape (vehicle, 3).
        body: classes of `scene.BODIES`, int32, shape (vehicle,).
        lidar: whether the vehicle carries a sensor, bool, shape (vehicle,).
        building_vertex: corners of all buildings, ring by ring, world frame [m], float64, shape
            (building_vertex, 2).
        building_index: the building each corner belongs to, ascending, int32, shape
            (building_vertex,).
        building_height: of the flat roofs above z = 0 [m], float64, shape (building,).
    """

    id: npt.NDArray[np.int64]
    position: npt.NDArray[np.float64]
    heading: npt.NDArray[np.float64]
    size: npt.NDArray[np.float64]
    body: npt.NDArray[np.int32]
    lidar: npt.NDArray[np.bool_]
    building_vertex: npt.NDArray[np.float64]
    building_index: npt.NDArray[np.int32]
    building_height: npt.NDArray[np.float64]

    @classmethod
    def read(cls, signals: Signals) -> Self:
        """The scene in the inputs of a step; it is not checked."""
        return cls(
            id=np.asarray(signals["vehicle.id"]),
            position=np.asarray(signals["vehicle.position"]),
            heading=np.asarray(signals["vehicle.heading"]),
            size=np.asarray(signals["vehicle.size"]),
            body=np.asarray(signals["vehicle.body"]),
            lidar=np.asarray(signals["vehicle.lidar"]),
            building_vertex=np.asarray(signals["building.vertex"]),
            building_index=np.asarray(signals["building.index"]),
            building_height=np.asarray(signals["building.height"]),
        )
