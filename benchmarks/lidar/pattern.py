"""The scan patterns that are measured, and the rays in them."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from benchmarks.lidar.town import Town

Float = npt.NDArray[np.float64]

MOUNT_HEIGHT: Final = 1.0
"""Height of the sensor over the roof [m], where no ray meets the body of the car that carries it.
The unit leaves that body out; for the peer it would take a scene of its own for each sensor."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Pattern:
    """A regular scan pattern on a tilted or a level sensor.

    Attributes:
        channels, azimuths: number of elevations and of azimuths.
        top, bottom: elevation of the first and of the last channel [rad].
        pitch, roll: nose down and right side down positive [rad].
        reach: the largest distance of a hit [m].
    """

    channels: int = 64
    azimuths: int = 1024
    top: float = math.radians(4)
    bottom: float = math.radians(-20)
    pitch: float = 0.0
    roll: float = 0.0
    reach: float = 50.0

    @property
    def rays(self) -> int:
        """How many there are in a scan."""
        return self.channels * self.azimuths

    def parameters(self) -> Mapping[str, float]:
        """The parameters of the lidar FMU that make this pattern."""
        return {
            "channels": self.channels,
            "azimuths": self.azimuths,
            "elevation_top": self.top,
            "elevation_bottom": self.bottom,
            "pitch": self.pitch,
            "roll": self.roll,
            "range": self.reach,
            "mount_height": MOUNT_HEIGHT,
        }

    def directions(self, heading: float) -> Float:
        """Unit vectors in the world frame, by azimuth, then channel; shape (rays, 3).

        `world = Rz(heading) Ry(pitch) Rx(roll) sensor`, as in docs/physics-lidar.md.
        """
        azimuth = np.arange(self.azimuths)[:, np.newaxis] * (2 * np.pi / self.azimuths)
        elevation = np.linspace(self.top, self.bottom, self.channels)
        x, y = np.cos(azimuth) * np.cos(elevation), np.sin(azimuth) * np.cos(elevation)
        z = np.broadcast_to(np.sin(elevation), x.shape)
        sensor = np.stack([x, y, z], axis=-1).reshape(-1, 3)
        c, s = np.cos([heading, self.pitch, self.roll]), np.sin([heading, self.pitch, self.roll])
        yaw = np.array([[c[0], -s[0], 0], [s[0], c[0], 0], [0, 0, 1]])
        pitch = np.array([[c[1], 0, s[1]], [0, 1, 0], [-s[1], 0, c[1]]])
        roll = np.array([[1, 0, 0], [0, c[2], -s[2]], [0, s[2], c[2]]])
        world: Float = sensor @ (yaw @ pitch @ roll).T
        return world


DEFAULT: Final = Pattern()
"""That of the lidar FMU."""


def sensor_position(town: Town, scan: int, vehicle: int) -> Float:
    """The position of the sensor on a vehicle, world frame [m], shape (3,)."""
    position: Float = town.position[scan, vehicle].copy()
    position[2] += town.size[vehicle, 2] + MOUNT_HEIGHT
    return position
