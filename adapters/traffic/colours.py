"""What bodies and lights look like from above, in every picture and every other tool."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

from adapters.traffic.bodies import Body
from orchestrator.palette import (
    BLACK,
    BLUE,
    BROWN,
    GREEN,
    GREY,
    MINT,
    ORANGE,
    PURPLE,
    SKY,
    VERMILLION,
)

BODY_COLOURS: Final[Mapping[Body, str]] = MappingProxyType(
    {
        Body.CAR: BLUE,
        Body.SUV: SKY,
        Body.VAN: PURPLE,
        Body.BUS: ORANGE,
        Body.TRUCK: BLACK,
        Body.RAIL: GREY,
        Body.MOTORCYCLE: BROWN,
        Body.BICYCLE: GREEN,
        Body.PEDESTRIAN: VERMILLION,
    }
)
LIGHT_COLOURS: Final = (GREY, VERMILLION, VERMILLION, ORANGE, MINT, GREEN, VERMILLION)
"""Colours by the codes of `light.state`."""

LIGHT_STATES: Final = (
    "off",
    "red",
    "red and amber",
    "amber",
    "green that gives way",
    "green",
    "right turn on red after a stop",
)
"""What the codes of `light.state` mean."""
