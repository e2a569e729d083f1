"""The connectors of `SumoTraffic`; docs/architecture.md explains them."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

import numpy as np
import numpy.typing as npt

from adapters.sumo.proximity import NOBODY_NEAR
from orchestrator.signal import Causality, Connector, Variability


def _output(
    description: str,
    *shape: int | str,
    dtype: npt.DTypeLike = np.float64,
    unit: str = "1",
    variability: Variability = Variability.DISCRETE,
) -> Connector:
    return Connector(
        causality=Causality.OUTPUT,
        dtype=dtype,
        shape=shape,
        unit=unit,
        variability=variability,
        description=description,
    )


_CONTINUOUS: Final = Variability.CONTINUOUS
_FIXED: Final = Variability.FIXED

CONNECTORS: Final[Mapping[str, Connector]] = MappingProxyType(
    {
        "command": Connector(
            causality=Causality.INPUT,
            shape=(3,),
            description="accelerate 0..1, brake 0..1, steer -1..1 (left positive)",
        ),
        "vehicle.id": _output("numbers, ascending, never reused", "vehicle", dtype=np.int64),
        "vehicle.position": _output(
            "centre of the body on the ground; x east, y north", "vehicle", 3, unit="m"
        ),
        "vehicle.heading": _output("counter-clockwise from east", "vehicle", unit="rad"),
        "vehicle.velocity": _output("in the plane", "vehicle", 2, unit="m/s"),
        "vehicle.size": _output("length, width, height", "vehicle", 3, unit="m"),
        "vehicle.antenna_height": _output("above the ground", "vehicle", unit="m"),
        "vehicle.body": _output(
            "0 car, 1 SUV or MPV, 2 van, 3 bus, 4 truck", "vehicle", dtype=np.int32
        ),
        "vehicle.equipped": _output("has a V2X radio", "vehicle", dtype=np.bool_),
        "vehicle.lidar": _output("carries a lidar", "vehicle", dtype=np.bool_),
        "vehicle.role": _output(
            "0 background, 1 ego, 2 collision vehicle, 3 sharing node, 4 blocking vehicle, "
            "5 roadside unit",
            "vehicle",
            dtype=np.int32,
        ),
        "building.vertex": _output(
            "corners, ring by ring, open rings",
            "building_vertex",
            2,
            unit="m",
            variability=_FIXED,
        ),
        "building.index": _output(
            "the building each corner belongs to",
            "building_vertex",
            dtype=np.int32,
            variability=_FIXED,
        ),
        "building.height": _output("above the ground", "building", unit="m", variability=_FIXED),
        "road.vertex": _output(
            "corners of the drivable surface, ring by ring, open rings that may overlap",
            "road_vertex",
            2,
            unit="m",
            variability=_FIXED,
        ),
        "road.index": _output(
            "the polygon each corner belongs to",
            "road_vertex",
            dtype=np.int32,
            variability=_FIXED,
        ),
        "ego.id": _output("number of the ego vehicle, -1 once it has left", dtype=np.int64),
        "ego.position": _output("centre of the body", 2, unit="m", variability=_CONTINUOUS),
        "ego.heading": _output("counter-clockwise from east", unit="rad"),
        "ego.speed": _output("along the heading", unit="m/s", variability=_CONTINUOUS),
        "ego.size": _output("length, width, height", 3, unit="m", variability=_FIXED),
        "ego.route": _output(
            "centre line of the route, from the vehicle on", "route_vertex", 2, unit="m"
        ),
        "ego.collision": _output("bodies have overlapped since the start", dtype=np.bool_),
        "ego.collision_time": _output(
            "when they were first seen to overlap, -1 if they have not; see `collision_step`",
            unit="s",
        ),
        "ego.collision_partner": _output(
            "the vehicle whose body it was, -1 if none", dtype=np.int64
        ),
        "ego.completion_time": _output(
            "when its rear bumper was `finish_distance` beyond the conflict point, or it left; "
            "-1 if it is not through, or collided before",
            unit="s",
        ),
        "ego.gap": _output(
            "smallest distance to another body over the last step; "
            f"{NOBODY_NEAR:g} m if there is none",
            unit="m",
        ),
        "ego.nearest": _output("the vehicle at that distance, -1 if none", dtype=np.int64),
        "encounter.over": _output("the ego has collided, or is through", dtype=np.bool_),
    }
)
