"""The connectors of driving policies: ego, route and what is known of others in, the command out.

All policies have the same inputs, so that one can take another's place in any scenario; what a
policy reads of them is the feedthrough of its outputs.
"""

import functools
from collections.abc import Mapping
from dataclasses import replace
from typing import Final

import numpy as np

from fmus.messages.connectors import POSE_ERROR as ERRORS, inputs, when_undriven
from orchestrator.absence import Need, Undriven
from orchestrator.signal import Causality, Connector

_EGO: Final = ("ego.id", "ego.position", "ego.heading", "ego.speed", "ego.size", "ego.route")
_VEHICLES: Final = (
    "vehicle.id",
    "vehicle.position",
    "vehicle.heading",
    "vehicle.velocity",
    "vehicle.size",
)
_SENSED: Final = ("points", "objects", "received.objects", "received.features")
INPUTS: Final[Mapping[str, Connector]] = inputs(*_EGO, *_SENSED, *_VEHICLES, *ERRORS)
"""The inputs of every policy; `vehicle.*`, the truth, are there for those that declare it."""

EGO: Final = frozenset(_EGO)
"""The inputs about the ego vehicle itself."""

VEHICLES: Final = frozenset(_VEHICLES)
"""The inputs with the truth about all vehicles."""

POSE_ERROR: Final = frozenset(ERRORS)
"""The inputs that say by how much each vehicle is wrong about its pose."""

SENSED: Final = frozenset(_SENSED)
"""The inputs that are where vehicles believe them to be; who reads one has to know where the ego
believes to be."""


_UNREAD: Final = Undriven("no matter: this policy does not read it", Need.NEVER)
_MEANINGS: Final = {
    "ego": Undriven("the policy does not know where its vehicle is, and never drives"),
    "points": Undriven("the policy never gets a scan, and sees nobody", Need.IF_OFFERED),
    "objects": Undriven(
        "the policy sees nobody, whatever is ahead",
        Need.IF_OFFERED,
        frozenset({"received.objects"}),
    ),
    "received.objects": Undriven(
        "the policy never hears of anybody, as if there were no V2X (`policy-blind` is meant so)",
        Need.IF_OFFERED,
        frozenset({"objects"}),
    ),
    "received.features": Undriven(
        "the policy never hears of anybody, as if there were no V2X",
        Need.IF_OFFERED,
        frozenset({"points"}),
    ),
    "vehicle": Undriven("the policy knows of no other vehicle"),
    "pose_error": Undriven("the ego knows exactly where it is", Need.IF_OFFERED),
}


@functools.cache
def connectors(reads: frozenset[str]) -> Mapping[str, Connector]:
    """The connectors of a policy whose outputs depend on the inputs `reads`."""

    def number(description: str) -> Connector:
        return Connector(
            causality=Causality.OUTPUT,
            dtype=np.int64,
            start=np.int64(-1),
            feedthrough=reads,
            description=description,
        )

    return {
        **{
            name: connector if name in reads else replace(connector, undriven=_UNREAD)
            for name, connector in when_undriven(INPUTS, _MEANINGS).items()
        },
        "command": Connector(
            causality=Causality.OUTPUT,
            shape=(3,),
            feedthrough=reads,
            description="Accelerate 0..1, brake 0..1, steer -1..1 (left positive)",
        ),
        "hazard.instance": number(
            "Track number of the object braked for, -1 if there is none; "
            "of the expert, the vehicle's number"
        ),
        "hazard.sensor": number("The vehicle whose sensor saw that object, -1 if there is none"),
        "hazard.age": Connector(
            causality=Causality.OUTPUT,
            unit="s",
            feedthrough=reads,
            description="Age of the scan in which it was seen",
        ),
    }
