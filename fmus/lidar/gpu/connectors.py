"""The connectors of the lidar; a test compares them with the lidar FMU's."""

from collections.abc import Mapping
from typing import Final

from fmus.lidar.undriven import UNDRIVEN
from fmus.messages.connectors import inputs, outputs, when_undriven
from orchestrator.signal import Connector

INPUTS: Final[Mapping[str, Connector]] = when_undriven(
    inputs(
        "vehicle.id",
        "vehicle.position",
        "vehicle.heading",
        "vehicle.size",
        "vehicle.body",
        "vehicle.lidar",
        "building.vertex",
        "building.index",
        "building.height",
    ),
    UNDRIVEN,
)

CONNECTORS: Final[Mapping[str, Connector]] = {**INPUTS, **outputs("points", feedthrough=INPUTS)}
