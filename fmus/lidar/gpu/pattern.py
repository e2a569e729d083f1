"""The scan pattern: in which directions a sensor looks, and how it is tilted."""

import math
from dataclasses import dataclass
from typing import Self

import torch
from torch import Tensor

from fmus.lidar.gpu.noise import ray_salts
from fmus.lidar.gpu.parameters import LidarParameters


@dataclass(frozen=True, slots=True, kw_only=True)
class Pattern:
    """Tables that follow from the parameters, on the device.

    A ray is numbered azimuth * channels + channel.

    Attributes:
        azimuths, channels: how many.
        reach: the largest distance of a hit [m].
        azimuth_x, azimuth_y: unit vectors, shape (azimuth,).
        level, rise: horizontal and vertical part of the unit vectors, shape (channel,).
        slope: minus the tangents of the elevations, ascending, shape (channel,).
        direction: x, y, z of the unit vectors in the sensor frame, shape (ray,) each.
        up: vertical part of the rays in the world, shape (ray,).
        salt: what distinguishes the random numbers of the rays, int64, shape (ray,).
        pitch, roll: cosine and sine of the tilt.
    """

    azimuths: int
    channels: int
    reach: float
    azimuth_x: Tensor
    azimuth_y: Tensor
    level: Tensor
    rise: Tensor
    slope: Tensor
    direction: tuple[Tensor, Tensor, Tensor]
    up: Tensor
    salt: Tensor
    pitch: tuple[float, float]
    roll: tuple[float, float]

    @property
    def rays(self) -> int:
        """The rays of one sensor."""
        return self.azimuths * self.channels

    @classmethod
    def of(cls, parameters: LidarParameters, device: torch.device) -> Self:
        """The tables, computed on the CPU so that all devices cast the same rays."""
        azimuth = 2.0 * math.pi * torch.arange(parameters.azimuths).double() / parameters.azimuths
        part = torch.arange(parameters.channels).double() / max(parameters.channels - 1, 1)
        span = parameters.elevation_bottom - parameters.elevation_top
        elevation = parameters.elevation_top + span * part
        level, rise = torch.cos(elevation), torch.sin(elevation)
        pitch = math.cos(parameters.pitch), math.sin(parameters.pitch)
        roll = math.cos(parameters.roll), math.sin(parameters.roll)
        x = torch.cos(azimuth)[:, None] * level
        left = torch.sin(azimuth)[:, None] * level
        # heading frame <- sensor frame: about x by the roll, then about y by the pitch
        up = (left * roll[1] + rise * roll[0]) * pitch[0] - x * pitch[1]
        return cls(
            azimuths=parameters.azimuths,
            channels=parameters.channels,
            reach=parameters.range,
            azimuth_x=torch.cos(azimuth).to(device),
            azimuth_y=torch.sin(azimuth).to(device),
            level=level.to(device),
            rise=rise.to(device),
            slope=(-rise / level).to(device),
            direction=(
                x.flatten().to(device),
                left.flatten().to(device),
                rise.repeat(parameters.azimuths).to(device),
            ),
            up=up.flatten().to(device),
            salt=ray_salts(parameters.azimuths, parameters.channels).to(device),
            pitch=pitch,
            roll=roll,
        )

    def into_sensor_frame(self, x: Tensor, y: Tensor, z: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """Vectors of the heading frame (x along the heading, z up) in the tilted sensor's frame.

        Equal vectors give equal bits wherever they stand in a tensor: products and sums are
        rounded one by one. Faces that share an edge stay tight by that.

        Args:
            x: components along the heading, float64, any shape.
            y: components to the left, of the shape of `x` and in its unit.
            z: components upwards, of the shape of `x` and in its unit.

        Returns:
            The components in the sensor frame, of the shape of `x` and in its unit each.
        """
        ahead = x * self.pitch[0] - z * self.pitch[1]
        up = x * self.pitch[1] + z * self.pitch[0]
        return ahead, y * self.roll[0] + up * self.roll[1], up * self.roll[0] - y * self.roll[1]
