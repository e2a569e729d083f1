"""The connectors of the lidar; a test compares them with the lidar FMU's."""

from collections.abc import Mapping
from typing import Final

from fmus.messages.connectors import inputs, outputs
from orchestrator.signal import Connector

INPUTS: Final[Mapping[str, Connector]] = inputs(
    "vehicle.id",
    "vehicle.position",
    "vehicle.heading",
    "vehicle.size",
    "vehicle.body",
    "vehicle.lidar",
    "building.vertex",
    "building.index",
    "building.height",
)

CONNECTORS: Final[Mapping[str, Connector]] = {**INPUTS, **outputs("points", feedthrough=INPUTS)}
