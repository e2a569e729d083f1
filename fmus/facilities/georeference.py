"""Where the world frame lies on the Earth, for messages that speak in degrees.

Positions on the air are latitude and longitude in steps of 1e-7 degrees (ETSI TS 102 894-2,
Latitude and Longitude). The world frame is the plane tangent at `ORIGIN`; all stations use the
same, so that only the steps matter, not where the frame lies.
"""

import math
from typing import Final

import numpy as np

from orchestrator.signal import Array

ORIGIN: Final = (49.0, 8.4)
"""Latitude and longitude of the world frame's origin [deg]; any place outside the poles serves."""

_STEP: Final = 1e-7
_NORTH: Final = math.radians(1.0) * 6_378_137.0
"""Metres per degree of latitude, on a sphere with the equatorial radius of WGS 84."""
_EAST: Final = _NORTH * math.cos(math.radians(ORIGIN[0]))


def to_geographic(position: Array) -> tuple[int, int]:
    """Latitude and longitude of a world position [m], shape (2,), in steps of 1e-7 deg."""
    latitude = ORIGIN[0] + float(position[1]) / _NORTH
    longitude = ORIGIN[1] + float(position[0]) / _EAST
    return round(latitude / _STEP), round(longitude / _STEP)


def from_geographic(latitude: int, longitude: int) -> Array:
    """The world position [m], shape (2,), of a latitude and longitude in steps of 1e-7 deg."""
    north = (latitude * _STEP - ORIGIN[0]) * _NORTH
    east = (longitude * _STEP - ORIGIN[1]) * _EAST
    return np.array([east, north])
