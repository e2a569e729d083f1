"""The connectors of the lidar; a test compares them with the lidar FMU's."""

from collections.abc import Mapping
from typing import Final

import numpy as np

from fmus.messages.records import POINTS_MIME
from orchestrator.signal import Causality, Connector

_IN: Final = Causality.INPUT
_INPUTS: Final[Mapping[str, Connector]] = {
    "vehicle.id": Connector(
        causality=_IN,
        dtype=np.int64,
        shape=("vehicle",),
        description="Number of the vehicle, 0 to 2147483647, ascending",
    ),
    "vehicle.position": Connector(
        causality=_IN,
        shape=("vehicle", 3),
        unit="m",
        description="Centre of the body's footprint; z is the ground",
    ),
    "vehicle.heading": Connector(
        causality=_IN,
        shape=("vehicle",),
        unit="rad",
        description="Counter-clockwise from the x axis",
    ),
    "vehicle.size": Connector(
        causality=_IN,
        shape=("vehicle", 3),
        unit="m",
        description="Length, width, height of the body",
    ),
    "vehicle.body": Connector(
        causality=_IN,
        dtype=np.int32,
        shape=("vehicle",),
        description="0 car, 1 SUV or MPV, 2 van, 3 bus, 4 truck",
    ),
    "vehicle.lidar": Connector(
        causality=_IN, dtype=np.bool_, shape=("vehicle",), description="Carries a lidar sensor"
    ),
    "building.vertex": Connector(
        causality=_IN,
        shape=("building_vertex", 2),
        unit="m",
        description="Corners of all buildings, ring by ring, open rings, either sense",
    ),
    "building.index": Connector(
        causality=_IN,
        dtype=np.int32,
        shape=("building_vertex",),
        description="The building each corner belongs to, 0 to n_building - 1, ascending",
    ),
    "building.height": Connector(
        causality=_IN, shape=("building",), unit="m", description="Of the flat roof above z = 0"
    ),
}

CONNECTORS: Final[Mapping[str, Connector]] = {
    **_INPUTS,
    "points": Connector(
        causality=Causality.OUTPUT,
        dtype=None,
        mime_type=POINTS_MIME,
        feedthrough=frozenset(_INPUTS),
        description="One scan of every sensor, taken at the communication point",
    ),
}
