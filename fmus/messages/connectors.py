"""The signals that the units exchange: what each is called, and its type, shape and unit.

A Python unit lists the names that it reads and writes; `inputs` and `outputs` make its connectors
of them. So one signal has one declaration, whoever gives or takes it. `fmus.native.scene` has the
scene for native units; tests compare the two forms of a unit.
"""

from collections.abc import Iterable, Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Final

import numpy as np
import numpy.typing as npt

from fmus.messages.bodies import BODY_CODES
from fmus.messages.records import (
    APMS_MIME,
    FEATURES_MIME,
    NO_VEHICLE,
    OBJECTS_MIME,
    PACKETS_MIME,
    POINTS_MIME,
    RECEPTIONS_MIME,
    TRANSMISSIONS_MIME,
)
from orchestrator.absence import Undriven, said_of
from orchestrator.meaning import Meaning
from orchestrator.signal import Array, Causality, Connector, Signals


def _numbers(
    description: str,
    *shape: int | str,
    dtype: npt.DTypeLike = np.float64,
    unit: str = "1",
    start: np.generic | None = None,
    meaning: Meaning | None = None,
) -> Connector:
    return Connector(
        causality=Causality.INPUT,
        dtype=dtype,
        shape=shape,
        unit=unit,
        start=start,
        description=description,
        meaning=meaning,
    )


def _records(mime_type: str, description: str) -> Connector:
    return Connector(
        causality=Causality.INPUT, dtype=None, mime_type=mime_type, description=description
    )


_NOBODY: Final = np.int64(NO_VEHICLE)

SIGNALS: Final[Mapping[str, Connector]] = MappingProxyType(
    {
        "vehicle.id": _numbers(
            "Number of the vehicle, 0 to 2147483647, ascending", "vehicle", dtype=np.int64
        ),
        "vehicle.position": _numbers(
            "Centre of the body's footprint; z is the ground", "vehicle", 3, unit="m"
        ),
        "vehicle.heading": _numbers("Counter-clockwise from the x axis", "vehicle", unit="rad"),
        "vehicle.velocity": _numbers("In the plane, world frame", "vehicle", 2, unit="m/s"),
        "vehicle.size": _numbers("Length, width, height of the body", "vehicle", 3, unit="m"),
        "vehicle.body": _numbers(BODY_CODES, "vehicle", dtype=np.int32),
        "vehicle.antenna_height": _numbers(
            "Above the ground, at the body's centre", "vehicle", unit="m"
        ),
        "vehicle.equipped": _numbers("Has a radio", "vehicle", dtype=np.bool_),
        "vehicle.lidar": _numbers("Carries a lidar sensor", "vehicle", dtype=np.bool_),
        "building.vertex": _numbers(
            "Corners of all buildings, ring by ring, open rings, either sense",
            "building_vertex",
            2,
            unit="m",
        ),
        "building.index": _numbers(
            "The building each corner belongs to, 0 to n_building - 1, ascending",
            "building_vertex",
            dtype=np.int32,
        ),
        "building.height": _numbers("Of the flat roof above z = 0", "building", unit="m"),
        "ego.id": _numbers(
            "Number of the ego vehicle, -1 if there is none", dtype=np.int64, start=_NOBODY
        ),
        "ego.position": _numbers("Centre of the body, world frame", 2, unit="m"),
        "ego.heading": _numbers("Counter-clockwise from the x axis", unit="rad"),
        "ego.speed": _numbers("Along the heading", unit="m/s"),
        "ego.size": _numbers("Length, width, height of the body", 3, unit="m"),
        "ego.route": _numbers(
            "Centre line of its route, from the vehicle on; empty: straight on",
            "route_vertex",
            2,
            unit="m",
        ),
        "points": _records(
            POINTS_MIME, "One scan of every sensor, taken at the communication point"
        ),
        "pose_error.vehicle": _numbers(
            "Vehicles that may be wrong about their poses, ascending", "located", dtype=np.int64
        ),
        "pose_error.position": _numbers(
            "Where each believes to be less where it is", "located", 2, unit="m"
        ),
        "pose_error.heading": _numbers(
            "The heading it believes less its own", "located", unit="rad"
        ),
        "apms": _records(APMS_MIME, "Abstract perception matrices of the last scans"),
        "objects": _records(OBJECTS_MIME, "Objects tracked in the last scans"),
        "features": _records(
            FEATURES_MIME,
            "Keypoints of the last scans, shared beside the objects; empty: the objects alone",
        ),
        "match.sharer": _numbers(
            "Vehicles whose data pays, the best first; -1 in unused entries",
            "sharer",
            dtype=np.int64,
        ),
        "match.trigger": _numbers("Whether any sharer's data pays", dtype=np.bool_),
        "blind_zone.center": _numbers(
            "Centres of the ego vehicle's blind zones, world frame", "blind_zone", 2, unit="m"
        ),
        "blind_zone.range": _numbers(
            "Half the side of each, 0 in unused entries", "blind_zone", unit="m"
        ),
        "relay": _numbers(
            "The vehicle that relays the sharer's data, -1 for the direct link",
            dtype=np.int64,
            start=_NOBODY,
            meaning=Meaning(names="vehicle", nobody=NO_VEHICLE),
        ),
        "packets": _records(
            PACKETS_MIME,
            "Packets that become ready for transmission in the next step; "
            "one that is held over several steps is sent once",
        ),
        "receptions": _records(
            RECEPTIONS_MIME, "Frames that ended at their receivers in the last step"
        ),
        "transmissions": _records(
            TRANSMISSIONS_MIME, "Frames that went on air, or were given up, in the last step"
        ),
        "busy_ratio": _numbers(
            "Share of the last complete window in which each radio heard or sent a frame", "vehicle"
        ),
        "received.apms": _records(
            APMS_MIME, "The newest APM of each source that reached the ego whole"
        ),
        "received.objects": _records(
            OBJECTS_MIME, "Objects in the last sensor data that reached the ego, per sharer"
        ),
        "received.features": _records(
            FEATURES_MIME,
            "Keypoints of the newest scans of each sharer that reached the ego so far",
        ),
        "received.sensor_data.count": _numbers(
            "Packets of sensor data for the ego that have reached it so far", dtype=np.int64
        ),
        "received.bsm.id": _numbers(
            "Neighbours whose BSM reached the ego lately, ascending", "neighbour", dtype=np.int64
        ),
        "received.bsm.position": _numbers("As the neighbour said", "neighbour", 2, unit="m"),
        "received.bsm.heading": _numbers("As the neighbour said", "neighbour", unit="rad"),
        "received.bsm.velocity": _numbers("As the neighbour said", "neighbour", 2, unit="m/s"),
        "received.bsm.size": _numbers("Length, width, height", "neighbour", 3, unit="m"),
        "received.bsm.antenna_height": _numbers("Above the ground", "neighbour", unit="m"),
        "received.bsm.age": _numbers("Time since it was sent", "neighbour", unit="s"),
        "received.link.transmitter": _numbers(
            "Whose BSMs: any neighbour's where the ego measured, else a matched sharer's",
            "measured_link",
            dtype=np.int64,
        ),
        "received.link.receiver": _numbers(
            "Who measured: the ego, or a neighbour that announced it in its BSM",
            "measured_link",
            dtype=np.int64,
        ),
        "received.link.power": _numbers(
            "Filtered power at the receiver", "measured_link", unit="dBm"
        ),
    }
)
"""Every signal that more than one Python unit takes or gives, declared as an input."""

RECEIVED_BSMS: Final = tuple(name for name in SIGNALS if name.startswith("received.bsm."))
"""What the ego knows of its neighbours by their BSMs."""

POSE_ERROR: Final = tuple(name for name in SIGNALS if name.startswith("pose_error."))
"""The errors of vehicles about their poses; see `fmus.messages.pose_errors`."""


def inputs(*names: str, description: str | None = None) -> dict[str, Connector]:
    """Connectors that read these signals.

    Args:
        names: of `SIGNALS`.
        description: what this unit makes of all of them, instead of what they are.
    """
    declared = {name: SIGNALS[name] for name in names}
    if description is None:
        return declared
    return {name: replace(signal, description=description) for name, signal in declared.items()}


def when_undriven(
    connectors: Mapping[str, Connector], meanings: Mapping[str, Undriven]
) -> dict[str, Connector]:
    """The inputs, with what it means that nothing drives them, by name or by group."""
    said = said_of(connectors, meanings)
    return {name: replace(each, undriven=said.get(name)) for name, each in connectors.items()}


def arrays_beneath(signals: Signals, group: str) -> dict[str, Array]:
    """The arrays of all signals beneath a name, as they are declared.

    Args:
        signals: have all of these, at least.
        group: a beginning of names of `SIGNALS`, such as `received.bsm`.

    Returns:
        By the rest of their names, such as `position`; of the declared shapes.
    """
    first = f"{group}."
    return {
        name.removeprefix(first): np.asarray(signals[name], declared.dtype)
        for name, declared in SIGNALS.items()
        if name.startswith(first)
    }


def outputs(*names: str, feedthrough: Iterable[str] = ()) -> dict[str, Connector]:
    """Connectors that write these signals.

    Args:
        names: of `SIGNALS`.
        feedthrough: the inputs that affect all of them at the same communication point.
    """
    affecting = frozenset(feedthrough)
    return {
        name: replace(SIGNALS[name], causality=Causality.OUTPUT, feedthrough=affecting)
        for name in names
    }
