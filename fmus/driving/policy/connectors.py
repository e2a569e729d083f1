"""The connectors of driving policies: ego, route and what is known of others in, the command out.

All policies have the same inputs, so that one can take another's place in any scenario; what a
policy reads of them is the feedthrough of its outputs.
"""

import functools
from collections.abc import Mapping
from typing import Final

import numpy as np

from fmus.messages.records import FEATURES_MIME, OBJECTS_MIME, POINTS_MIME
from orchestrator.signal import Causality, Connector

_IN: Final = Causality.INPUT
_OUT: Final = Causality.OUTPUT
INPUTS: Final[Mapping[str, Connector]] = {
    "ego.id": Connector(causality=_IN, dtype=np.int64, start=np.int64(-1)),
    "ego.position": Connector(causality=_IN, shape=(2,), unit="m"),
    "ego.heading": Connector(causality=_IN, unit="rad"),
    "ego.speed": Connector(causality=_IN, unit="m/s"),
    "ego.size": Connector(causality=_IN, shape=(3,), unit="m"),
    "ego.route": Connector(causality=_IN, shape=("route_vertex", 2), unit="m"),
    "points": Connector(
        causality=_IN, dtype=None, mime_type=POINTS_MIME, description="of all lidars"
    ),
    "objects": Connector(causality=_IN, dtype=None, mime_type=OBJECTS_MIME),
    "received.objects": Connector(causality=_IN, dtype=None, mime_type=OBJECTS_MIME),
    "received.features": Connector(causality=_IN, dtype=None, mime_type=FEATURES_MIME),
    "vehicle.id": Connector(
        causality=_IN,
        dtype=np.int64,
        shape=("vehicle",),
        description="the true vehicles, the ego among them; for the expert only",
    ),
    "vehicle.position": Connector(causality=_IN, shape=("vehicle", 3), unit="m"),
    "vehicle.heading": Connector(causality=_IN, shape=("vehicle",), unit="rad"),
    "vehicle.velocity": Connector(causality=_IN, shape=("vehicle", 2), unit="m/s"),
    "vehicle.size": Connector(causality=_IN, shape=("vehicle", 3), unit="m"),
}

EGO: Final = frozenset(name for name in INPUTS if name.startswith("ego."))
"""The inputs about the ego vehicle itself."""

VEHICLES: Final = frozenset(name for name in INPUTS if name.startswith("vehicle."))
"""The inputs with the truth about all vehicles."""


@functools.cache
def connectors(reads: frozenset[str]) -> Mapping[str, Connector]:
    """The connectors of a policy whose outputs depend on the inputs `reads`."""
    outputs = {
        "command": Connector(
            causality=_OUT,
            shape=(3,),
            feedthrough=reads,
            description="accelerate 0..1, brake 0..1, steer -1..1 (left positive)",
        ),
        "hazard.instance": Connector(
            causality=_OUT,
            dtype=np.int64,
            start=np.int64(-1),
            feedthrough=reads,
            description="track number of the object braked for, -1 if there is none; "
            "of the expert, the vehicle's number",
        ),
        "hazard.sensor": Connector(
            causality=_OUT,
            dtype=np.int64,
            start=np.int64(-1),
            feedthrough=reads,
            description="the vehicle whose sensor saw that object, -1 if there is none",
        ),
        "hazard.age": Connector(
            causality=_OUT,
            unit="s",
            feedthrough=reads,
            description="age of the scan in which it was seen",
        ),
    }
    return {**INPUTS, **outputs}
