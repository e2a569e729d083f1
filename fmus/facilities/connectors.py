"""The connectors of the facilities layer."""

from collections.abc import Mapping
from typing import Final

import numpy as np

from fmus.messages.records import (
    APMS_MIME,
    FEATURES_MIME,
    OBJECTS_MIME,
    PACKETS_MIME,
    RECEPTIONS_MIME,
)
from orchestrator.signal import Causality, Connector

_IN: Final = Causality.INPUT
_OUT: Final = Causality.OUTPUT
_RECEPTIONS: Final = frozenset({"receptions"})
_LINKS: Final = frozenset({"receptions", "match.sharer"})

CONNECTORS: Final[Mapping[str, Connector]] = {
    "vehicle.id": Connector(causality=_IN, dtype=np.int64, shape=("vehicle",)),
    "vehicle.position": Connector(causality=_IN, shape=("vehicle", 3), unit="m"),
    "vehicle.heading": Connector(causality=_IN, shape=("vehicle",), unit="rad"),
    "vehicle.velocity": Connector(causality=_IN, shape=("vehicle", 2), unit="m/s"),
    "vehicle.size": Connector(causality=_IN, shape=("vehicle", 3), unit="m"),
    "vehicle.antenna_height": Connector(causality=_IN, shape=("vehicle",), unit="m"),
    "vehicle.equipped": Connector(causality=_IN, dtype=np.bool_, shape=("vehicle",)),
    "ego.id": Connector(causality=_IN, dtype=np.int64, start=np.int64(-1)),
    "apms": Connector(causality=_IN, dtype=None, mime_type=APMS_MIME),
    "objects": Connector(causality=_IN, dtype=None, mime_type=OBJECTS_MIME),
    "features": Connector(
        causality=_IN,
        dtype=None,
        mime_type=FEATURES_MIME,
        description="of the last scans, shared beside the objects; without them the objects alone",
    ),
    "match.sharer": Connector(causality=_IN, dtype=np.int64, shape=("sharer",)),
    "match.trigger": Connector(causality=_IN, dtype=np.bool_),
    "blind_zone.center": Connector(causality=_IN, shape=("blind_zone", 2), unit="m"),
    "blind_zone.range": Connector(causality=_IN, shape=("blind_zone",), unit="m"),
    "relay": Connector(causality=_IN, dtype=np.int64, start=np.int64(-1)),
    "receptions": Connector(causality=_IN, dtype=None, mime_type=RECEPTIONS_MIME),
    "packets": Connector(
        causality=_OUT,
        dtype=None,
        mime_type=PACKETS_MIME,
        feedthrough=frozenset({"vehicle.id", "apms", "objects", "features"}),
        description="packets that become ready for transmission in the next step",
    ),
    "received.apms": Connector(
        causality=_OUT,
        dtype=None,
        mime_type=APMS_MIME,
        feedthrough=_RECEPTIONS,
        description="the newest APM of each source that reached the ego whole",
    ),
    "received.objects": Connector(
        causality=_OUT,
        dtype=None,
        mime_type=OBJECTS_MIME,
        feedthrough=_RECEPTIONS,
        description="objects in the last sensor data that reached the ego, per sharer",
    ),
    "received.features": Connector(
        causality=_OUT,
        dtype=None,
        mime_type=FEATURES_MIME,
        feedthrough=_RECEPTIONS,
        description="keypoints of the newest scans of each sharer that reached the ego so far",
    ),
    "received.sensor_data.count": Connector(
        causality=_OUT,
        dtype=np.int64,
        feedthrough=_RECEPTIONS,
        description="packets of sensor data for the ego that have reached it so far",
    ),
    "received.bsm.id": Connector(
        causality=_OUT, dtype=np.int64, shape=("neighbour",), feedthrough=_RECEPTIONS
    ),
    "received.bsm.position": Connector(
        causality=_OUT, shape=("neighbour", 2), unit="m", feedthrough=_RECEPTIONS
    ),
    "received.bsm.heading": Connector(
        causality=_OUT, shape=("neighbour",), unit="rad", feedthrough=_RECEPTIONS
    ),
    "received.bsm.velocity": Connector(
        causality=_OUT, shape=("neighbour", 2), unit="m/s", feedthrough=_RECEPTIONS
    ),
    "received.bsm.size": Connector(
        causality=_OUT, shape=("neighbour", 3), unit="m", feedthrough=_RECEPTIONS
    ),
    "received.bsm.antenna_height": Connector(
        causality=_OUT, shape=("neighbour",), unit="m", feedthrough=_RECEPTIONS
    ),
    "received.bsm.age": Connector(
        causality=_OUT, shape=("neighbour",), unit="s", feedthrough=_RECEPTIONS
    ),
    "received.link.transmitter": Connector(
        causality=_OUT,
        dtype=np.int64,
        shape=("measured_link",),
        feedthrough=_LINKS,
        description="whose BSMs: any neighbour's where the ego measured, else a matched sharer's",
    ),
    "received.link.receiver": Connector(
        causality=_OUT,
        dtype=np.int64,
        shape=("measured_link",),
        feedthrough=_LINKS,
        description="who measured: the ego, or a neighbour that announced it in its BSM",
    ),
    "received.link.power": Connector(
        causality=_OUT,
        shape=("measured_link",),
        unit="dBm",
        feedthrough=_LINKS,
        description="filtered power at the receiver",
    ),
}
