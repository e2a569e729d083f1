"""Clouds of a lidar with a regular pattern over flat ground, with upright walls on it."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from fmus.messages.apm import Float
from tests.fmus.perception.scene import SENSOR_HEIGHT, Scan

AZIMUTHS: Final = 1024
ELEVATIONS: Final = np.radians(np.linspace(4.0, -20.0, 64))
STEP: Final = float(ELEVATIONS[0] - ELEVATIONS[1])
"""Between two channels [rad]."""
RANGE: Final = 50.0
FARTHEST: Final = float(np.sqrt(RANGE**2 - SENSOR_HEIGHT**2))
"""Where the ground ends for the sensor [m]."""
NEAREST: Final = float(SENSOR_HEIGHT / np.tan(np.radians(20.0) + STEP / 2))
"""Where it begins: half a step below the lowest channel [m]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Wall:
    """An opaque, upright wall between two points, seen from both sides.

    Attributes:
        ends: world frame [m].
        height: [m].
    """

    ends: tuple[tuple[float, float], tuple[float, float]]
    height: float = 10.0


def sweep(
    vehicle: int,
    walls: Sequence[Wall] = (),
    *,
    origin: tuple[float, float] = (0.0, 0.0),
    heading: float = 0.0,
    pitch: float = 0.0,
    roll: float = 0.0,
) -> Scan:
    """One noise-free scan, by azimuth and then by channel."""
    position = (*origin, SENSOR_HEIGHT)
    empty = Scan(
        vehicle=vehicle,
        points=np.empty((0, 3)),
        position=position,
        heading=heading,
        pitch=pitch,
        roll=roll,
    )
    azimuth = np.arange(AZIMUTHS)[:, None] * (2 * np.pi / AZIMUTHS)
    level, up = np.cos(ELEVATIONS), np.sin(ELEVATIONS) + 0 * azimuth
    local = np.stack([level * np.cos(azimuth), level * np.sin(azimuth), up], axis=-1)
    rays: Float = local.reshape(-1, 3) @ empty.rotation().T
    with np.errstate(divide="ignore", invalid="ignore"):
        distance = np.where(rays[:, 2] < 0, -SENSOR_HEIGHT / rays[:, 2], np.inf)
        for wall in walls:
            distance = np.minimum(distance, _to_wall(wall, np.array(position), rays))
    hits = distance < RANGE
    points = np.array(position) + distance[hits, None] * rays[hits]
    return Scan(
        vehicle=vehicle,
        points=points,
        position=position,
        heading=heading,
        pitch=pitch,
        roll=roll,
    )


def _to_wall(wall: Wall, position: Float, rays: Float) -> Float:
    """Distance along each ray, infinite where it misses."""
    start, end = np.array(wall.ends)
    along = end - start
    to_start = start - position[:2]
    cross = rays[:, 0] * along[1] - rays[:, 1] * along[0]
    distance = (to_start[0] * along[1] - to_start[1] * along[0]) / cross
    part = (to_start[0] * rays[:, 1] - to_start[1] * rays[:, 0]) / cross
    height = position[2] + distance * rays[:, 2]
    meets = (distance > 0) & (part >= 0) & (part <= 1) & (height >= 0) & (height <= wall.height)
    return np.where(meets, distance, np.inf)
