"""The connectors of the channel, except `probe.*`; a test compares them with the channel FMU's."""

from collections.abc import Mapping
from typing import Final

from fmus.channel.undriven import PACKETS, UNUSED_BUILDINGS, VEHICLES
from fmus.messages.connectors import inputs, outputs, when_undriven
from orchestrator.signal import Connector

CONNECTORS: Final[Mapping[str, Connector]] = {
    **when_undriven(
        {
            **inputs(
                "vehicle.id",
                "vehicle.position",
                "vehicle.heading",
                "vehicle.size",
                "vehicle.antenna_height",
                "vehicle.equipped",
            ),
            **inputs(
                "building.vertex",
                "building.index",
                "building.height",
                description="taken, not used",
            ),
            **inputs("packets"),
        },
        {"vehicle": VEHICLES, "building": UNUSED_BUILDINGS, "packets": PACKETS},
    ),
    **outputs("receptions", "transmissions", "busy_ratio"),
}
