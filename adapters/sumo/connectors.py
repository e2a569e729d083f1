"""The connectors of `SumoTraffic`: those of all traffic, lights, and one group for each ego."""

from collections.abc import Iterable, Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Final

import numpy as np

from adapters.sumo.proximity import NOBODY_NEAR
from adapters.traffic.connectors import SURROUNDINGS, VEHICLES, output
from orchestrator.absence import Need, Undriven
from orchestrator.signal import Causality, Connector, Variability

_CONTINUOUS: Final = Variability.CONTINUOUS
_FIXED: Final = Variability.FIXED

LIGHTS: Final[Mapping[str, Connector]] = MappingProxyType(
    {
        "light.state": output(
            "of each signal: 0 off, 1 red, 2 red and amber, 3 amber, 4 green that gives way, "
            "5 green; 6 right turn on red after a stop",
            "signal",
            dtype=np.int32,
        ),
        "light.controller": output(
            "the traffic light it belongs to, counted in the order of their names",
            "signal",
            dtype=np.int32,
            variability=_FIXED,
        ),
        "light.position": output(
            "where the lane ends that leads to it", "signal", 2, unit="m", variability=_FIXED
        ),
        "light.heading": output(
            "of that lane there, counter-clockwise from east",
            "signal",
            unit="rad",
            variability=_FIXED,
        ),
    }
)
"""Traffic lights, signal by signal in SUMO's order."""

COMMAND: Final = Connector(
    causality=Causality.INPUT,
    shape=(3,),
    description="accelerate 0..1, brake 0..1, steer -1..1 (left positive)",
)

OVER: Final = "encounter.over"

RESERVED: Final = frozenset({"vehicle", "entered", "building", "road", "light", "encounter"})
"""Groups of connectors; no driven entity may be called so."""


def connectors(egos: Iterable[str]) -> Mapping[str, Connector]:
    """All connectors.

    Args:
        egos: the names of the driven entities.
    """
    names = tuple(egos)
    found = {**VEHICLES, **SURROUNDINGS, **LIGHTS}
    for name in names:
        routes = "route_vertex" if len(names) == 1 else f"{name}.route_vertex"
        found |= {f"{name}.{key}": connector for key, connector in _of_one(name, routes).items()}
    found[OVER] = output(
        "every ego vehicle has collided, or is through; never without one", dtype=np.bool_
    )
    return MappingProxyType(found)


def _of_one(name: str, routes: str) -> Mapping[str, Connector]:
    """The group of the driven entity `name`; `routes` is the axis of its route."""
    return {
        "command": replace(
            COMMAND,
            undriven=Undriven(
                f"`{name}` keeps its speed and heading, whatever is ahead; connect the "
                "`command` of a policy, or leave `controller: policy` out",
                Need.IF_OFFERED,
            ),
            parameter=("entities", name),
        ),
        "id": output("number of the vehicle, -1 while it is not there", dtype=np.int64),
        "position": output("centre of the body", 2, unit="m", variability=_CONTINUOUS),
        "heading": output("counter-clockwise from east", unit="rad"),
        "speed": output("along the heading", unit="m/s", variability=_CONTINUOUS),
        "size": output("length, width, height", 3, unit="m", variability=_FIXED),
        "route": output("centre line of the route, from the vehicle on", routes, 2, unit="m"),
        "collision": output("bodies have overlapped since the start", dtype=np.bool_),
        "collision_time": output(
            "when they were first seen to overlap, -1 if they have not; see `collision_step`",
            unit="s",
        ),
        "collision_partner": output("the vehicle whose body it was, -1 if none", dtype=np.int64),
        "completion_time": output(
            "when it was through, as `finish` says, or left; -1 if not, or if it collided before",
            unit="s",
        ),
        "gap": output(
            "smallest distance to another body over the last step; "
            f"{NOBODY_NEAR:g} m if there is none",
            unit="m",
        ),
        "nearest": output("the vehicle at that distance, -1 if none", dtype=np.int64),
    }
