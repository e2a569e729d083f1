"""The connectors of relay policies: what the ego knows in, the choice out."""

from collections.abc import Mapping
from typing import Final

import numpy as np

from fmus.messages.records import APMS_MIME, NO_VEHICLE, OBJECTS_MIME
from orchestrator.signal import Causality, Connector

_IN: Final = Causality.INPUT
_OUT: Final = Causality.OUTPUT

INPUTS: Final[Mapping[str, Connector]] = {
    "ego.id": Connector(causality=_IN, dtype=np.int64, start=np.int64(NO_VEHICLE)),
    "ego.position": Connector(causality=_IN, shape=(2,), unit="m"),
    "ego.heading": Connector(causality=_IN, unit="rad"),
    "ego.speed": Connector(causality=_IN, unit="m/s"),
    "ego.size": Connector(causality=_IN, shape=(3,), unit="m"),
    "ego.route": Connector(
        causality=_IN,
        shape=("route_vertex", 2),
        unit="m",
        description="centre line of its route, from the vehicle on; empty: straight on",
    ),
    "building.vertex": Connector(causality=_IN, shape=("building_vertex", 2), unit="m"),
    "building.index": Connector(causality=_IN, dtype=np.int32, shape=("building_vertex",)),
    "objects": Connector(causality=_IN, dtype=None, mime_type=OBJECTS_MIME),
    "received.apms": Connector(causality=_IN, dtype=None, mime_type=APMS_MIME),
    "received.bsm.id": Connector(causality=_IN, dtype=np.int64, shape=("neighbour",)),
    "received.bsm.position": Connector(causality=_IN, shape=("neighbour", 2), unit="m"),
    "received.bsm.heading": Connector(causality=_IN, shape=("neighbour",), unit="rad"),
    "received.bsm.velocity": Connector(causality=_IN, shape=("neighbour", 2), unit="m/s"),
    "received.bsm.size": Connector(causality=_IN, shape=("neighbour", 3), unit="m"),
    "received.bsm.antenna_height": Connector(causality=_IN, shape=("neighbour",), unit="m"),
    "received.bsm.age": Connector(causality=_IN, shape=("neighbour",), unit="s"),
    "received.link.transmitter": Connector(causality=_IN, dtype=np.int64, shape=("measured_link",)),
    "received.link.receiver": Connector(causality=_IN, dtype=np.int64, shape=("measured_link",)),
    "received.link.power": Connector(causality=_IN, shape=("measured_link",), unit="dBm"),
    "received.sensor_data.count": Connector(causality=_IN, dtype=np.int64),
    "match.sharer": Connector(causality=_IN, dtype=np.int64, shape=("sharer",)),
    "match.trigger": Connector(causality=_IN, dtype=np.bool_),
}
_FEEDTHROUGH: Final = frozenset(INPUTS)
OUTPUTS: Final[Mapping[str, Connector]] = {
    "relay": Connector(
        causality=_OUT,
        dtype=np.int64,
        start=np.int64(NO_VEHICLE),
        feedthrough=_FEEDTHROUGH,
        description="the vehicle that relays the sharer's data, -1 for the direct link",
    ),
    "switches": Connector(
        causality=_OUT,
        dtype=np.int64,
        feedthrough=_FEEDTHROUGH,
        description="how often the choice changed while fusion was triggered",
    ),
    "risk.direct": Connector(causality=_OUT, unit="dB.s/m", feedthrough=_FEEDTHROUGH),
    "risk.chosen": Connector(causality=_OUT, unit="dB.s/m", feedthrough=_FEEDTHROUGH),
}
CONNECTORS: Final = {**INPUTS, **OUTPUTS}
