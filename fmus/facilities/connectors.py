"""The connectors of the facilities layer."""

from collections.abc import Mapping
from typing import Final

from fmus.messages.connectors import inputs, outputs
from orchestrator.signal import Connector

INPUTS: Final[Mapping[str, Connector]] = inputs(
    "vehicle.id",
    "vehicle.position",
    "vehicle.heading",
    "vehicle.velocity",
    "vehicle.size",
    "vehicle.antenna_height",
    "vehicle.equipped",
    "ego.id",
    "apms",
    "objects",
    "features",
    "match.sharer",
    "match.trigger",
    "blind_zone.center",
    "blind_zone.range",
    "relay",
    "receptions",
)

OUTPUTS: Final[Mapping[str, Connector]] = {
    **outputs("packets", feedthrough=("vehicle.id", "apms", "objects", "features")),
    **outputs(
        "received.apms",
        "received.objects",
        "received.features",
        "received.sensor_data.count",
        "received.bsm.id",
        "received.bsm.position",
        "received.bsm.heading",
        "received.bsm.velocity",
        "received.bsm.size",
        "received.bsm.antenna_height",
        "received.bsm.age",
        feedthrough=("receptions",),
    ),
    **outputs(
        "received.link.transmitter",
        "received.link.receiver",
        "received.link.power",
        feedthrough=("receptions", "match.sharer"),
    ),
}

CONNECTORS: Final[Mapping[str, Connector]] = {**INPUTS, **OUTPUTS}
