"""The bodies of road users: codes of `vehicle.body`, and what SUMO's vehicle classes look like."""

from collections.abc import Mapping
from enum import IntEnum
from types import MappingProxyType
from typing import Final


class Body(IntEnum):
    """The values of `vehicle.body`."""

    CAR = 0
    SUV = 1
    VAN = 2
    BUS = 3
    TRUCK = 4
    RAIL = 5
    MOTORCYCLE = 6
    BICYCLE = 7
    PEDESTRIAN = 8


BODIES: Final[Mapping[str, Body]] = MappingProxyType({body.name.lower(): body for body in Body})
"""The bodies by the names that a `<param key="body">`, a table or a scenario may say."""

_TALL_CAR: Final = 1.6
"""Passenger cars from this height [m] on have the shape of an SUV or MPV; SUMO's default is 1.5."""

_OF_CLASS: Final[Mapping[str, Body]] = MappingProxyType(
    {
        "delivery": Body.VAN,
        "emergency": Body.VAN,
        "bus": Body.BUS,
        "coach": Body.BUS,
        "truck": Body.TRUCK,
        "trailer": Body.TRUCK,
        "container": Body.TRUCK,
        "tram": Body.RAIL,
        "rail_urban": Body.RAIL,
        "rail": Body.RAIL,
        "rail_electric": Body.RAIL,
        "rail_fast": Body.RAIL,
        "subway": Body.RAIL,
        "cable_car": Body.RAIL,
        "motorcycle": Body.MOTORCYCLE,
        "moped": Body.MOTORCYCLE,
        "bicycle": Body.BICYCLE,
        "scooter": Body.BICYCLE,
        "pedestrian": Body.PEDESTRIAN,
        "wheelchair": Body.PEDESTRIAN,
    }
)
"""The bodies of SUMO's abstract vehicle classes; all others have those of passenger cars."""


def body_of(vehicle_class: str, height: float) -> Body:
    """The body of a vehicle type that names none.

    Args:
        vehicle_class: SUMO's `vClass`.
        height: of the body [m].
    """
    found = _OF_CLASS.get(vehicle_class)
    if found is not None:
        return found
    return Body.SUV if height >= _TALL_CAR else Body.CAR


def is_motorised(body: Body) -> bool:
    """Whether a road user has an engine: neither a bicycle nor on foot."""
    return body not in {Body.BICYCLE, Body.PEDESTRIAN}
