"""The connectors of sources of traffic; docs/architecture.md explains them."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

import numpy as np
import numpy.typing as npt

from orchestrator.meaning import Meaning
from orchestrator.signal import Causality, Connector, Variability

ENTERED_MIME: Final = "application/json; content=entered; events"
"""A JSON list of [number, name, type] of those who entered, in the order of their numbers."""


def output(
    description: str,
    *shape: int | str,
    dtype: npt.DTypeLike = np.float64,
    unit: str = "1",
    variability: Variability = Variability.DISCRETE,
    meaning: Meaning | None = None,
) -> Connector:
    """An output that is an array."""
    return Connector(
        causality=Causality.OUTPUT,
        dtype=dtype,
        shape=shape,
        unit=unit,
        variability=variability,
        description=description,
        meaning=meaning,
    )


_FIXED: Final = Variability.FIXED

VEHICLES: Final[Mapping[str, Connector]] = MappingProxyType(
    {
        "vehicle.id": output(
            "numbers, ascending, never reused",
            "vehicle",
            dtype=np.int64,
            meaning=Meaning(numbers="vehicle", minimum=0, is_ascending=True),
        ),
        "vehicle.position": output(
            "centre of the body on the ground; x east, y north", "vehicle", 3, unit="m"
        ),
        "vehicle.heading": output("counter-clockwise from east", "vehicle", unit="rad"),
        "vehicle.velocity": output("in the plane", "vehicle", 2, unit="m/s"),
        "vehicle.size": output("length, width, height", "vehicle", 3, unit="m"),
        "vehicle.antenna_height": output("above the ground", "vehicle", unit="m"),
        "vehicle.body": output(
            "0 car, 1 SUV or MPV, 2 van, 3 bus, 4 truck, 5 tram or train, 6 motorcycle, "
            "7 bicycle, 8 pedestrian",
            "vehicle",
            dtype=np.int32,
        ),
        "vehicle.equipped": output("has a V2X radio", "vehicle", dtype=np.bool_),
        "vehicle.lidar": output("carries a lidar", "vehicle", dtype=np.bool_),
        "vehicle.role": output(
            "0 if the scenario does not declare it; 1 for the first of its `entities`, 2 for the "
            "second, ...",
            "vehicle",
            dtype=np.int32,
        ),
        "entered": Connector(
            causality=Causality.OUTPUT,
            dtype=None,
            mime_type=ENTERED_MIME,
            description="number, name and type of each that was not there at the last "
            "communication point, as JSON",
        ),
    }
)
"""Every road user: vehicles, riders, persons on foot, roadside units."""

SURROUNDINGS: Final[Mapping[str, Connector]] = MappingProxyType(
    {
        "building.vertex": output(
            "corners, ring by ring, open rings",
            "building_vertex",
            2,
            unit="m",
            variability=_FIXED,
        ),
        "building.index": output(
            "the building each corner belongs to",
            "building_vertex",
            dtype=np.int32,
            variability=_FIXED,
        ),
        "building.height": output("above the ground", "building", unit="m", variability=_FIXED),
        "road.vertex": output(
            "corners of the drivable surface, ring by ring, open rings that may overlap",
            "road_vertex",
            2,
            unit="m",
            variability=_FIXED,
        ),
        "road.index": output(
            "the polygon each corner belongs to",
            "road_vertex",
            dtype=np.int32,
            variability=_FIXED,
        ),
    }
)
"""Buildings and roads."""
