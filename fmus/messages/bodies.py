"""The bodies of road users: the codes of `vehicle.body`, declared once for all units.

For the native units records.h is made from here, too, see `fmus.native.c_records`.
"""

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


_WORDS: Final[Mapping[Body, str]] = MappingProxyType(
    {Body.SUV: "SUV or MPV", Body.RAIL: "tram or train"}
)
"""Where the word is not the name."""

BODY_CODES: Final = ", ".join(
    f"{body.value} {_WORDS.get(body, body.name.lower())}" for body in Body
)
"""All codes in words, as descriptions and messages have them."""
