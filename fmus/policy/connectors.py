"""The connectors of driving policies: ego, route and objects in, the command out."""

from collections.abc import Mapping
from typing import Final

import numpy as np

from fmus.records import OBJECTS_MIME
from orchestrator.signal import Causality, Connector

_IN: Final = Causality.INPUT
_OUT: Final = Causality.OUTPUT
INPUTS: Final[Mapping[str, Connector]] = {
    "ego.id": Connector(causality=_IN, dtype=np.int64, start=np.int64(-1)),
    "ego.position": Connector(causality=_IN, shape=(2,), unit="m"),
    "ego.speed": Connector(causality=_IN, unit="m/s"),
    "ego.size": Connector(causality=_IN, shape=(3,), unit="m"),
    "ego.route": Connector(causality=_IN, shape=("route_vertex", 2), unit="m"),
    "objects": Connector(causality=_IN, dtype=None, mime_type=OBJECTS_MIME),
    "received.objects": Connector(causality=_IN, dtype=None, mime_type=OBJECTS_MIME),
}
_FEEDTHROUGH: Final = frozenset(INPUTS)
OUTPUTS: Final[Mapping[str, Connector]] = {
    "command": Connector(
        causality=_OUT,
        shape=(3,),
        feedthrough=_FEEDTHROUGH,
        description="accelerate 0..1, brake 0..1, steer -1..1",
    ),
    "hazard.instance": Connector(
        causality=_OUT,
        dtype=np.int64,
        start=np.int64(-1),
        feedthrough=_FEEDTHROUGH,
        description="track number of the object braked for, -1 if there is none",
    ),
    "hazard.sensor": Connector(
        causality=_OUT,
        dtype=np.int64,
        start=np.int64(-1),
        feedthrough=_FEEDTHROUGH,
        description="the vehicle whose sensor saw that object, -1 if there is none",
    ),
    "hazard.age": Connector(
        causality=_OUT,
        unit="s",
        feedthrough=_FEEDTHROUGH,
        description="age of the scan in which it was seen",
    ),
}

CONNECTORS: Final = {**INPUTS, **OUTPUTS}
