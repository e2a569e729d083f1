"""The connectors of the channel, except `probe.*`; a test compares them with the channel FMU's."""

from collections.abc import Mapping
from typing import Final

from fmus.messages.connectors import inputs, outputs
from orchestrator.signal import Connector

CONNECTORS: Final[Mapping[str, Connector]] = {
    **inputs(
        "vehicle.id",
        "vehicle.position",
        "vehicle.heading",
        "vehicle.size",
        "vehicle.antenna_height",
        "vehicle.equipped",
    ),
    **inputs("building.vertex", "building.index", "building.height", description="taken, not used"),
    **inputs("packets"),
    **outputs("receptions", "transmissions", "busy_ratio"),
}
