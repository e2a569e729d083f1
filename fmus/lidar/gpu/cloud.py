"""Points as the sensors report them: range noise, dropout and intensity."""

from dataclasses import dataclass
from typing import Final

import torch
from torch import Tensor

from fmus.lidar.gpu.hits import Hits
from fmus.lidar.gpu.noise import high_half, low_half, normal_quantile, random_bits
from fmus.lidar.gpu.pattern import Pattern
from fmus.lidar.gpu.ragged import pick
from fmus.lidar.gpu.view import PrismTensors, View

ATTENUATION: Final = 0.004
"""Extinction of the returned light [1/m]; the default of CARLA's lidar."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Noise:
    """Errors of the sensors.

    Attributes:
        deviation: standard deviation of the range [m].
        dropout: probability that a hit is not reported.
    """

    deviation: float
    dropout: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Points:
    """The reported points, by sensor, azimuth and channel.

    Attributes:
        record: the bits of `fmus.messages.records.POINT`, int32, shape (point, 5).
        sensor: of each point, int64, shape (point,).
    """

    record: Tensor
    sensor: Tensor


def reported(hits: Hits, key: Tensor, noise: Noise, pattern: Pattern) -> tuple[Hits, Tensor]:
    """The hits that are not lost, and the measured range of each [m].

    Args:
        hits: of all sensors.
        key: of the random numbers of each sensor, int64, shape (sensor,).
        noise: how large it is.
        pattern: the rays.

    Returns:
        These hits, and the measured ranges [m], float64, shape (hit,).
    """
    bits = random_bits(pick(key, hits.sensor) + pick(pattern.salt, hits.ray))
    kept = torch.nonzero(low_half(bits) >= int(noise.dropout * 2**32))[:, 0]
    found = Hits(
        sensor=pick(hits.sensor, kept),
        ray=pick(hits.ray, kept),
        distance=pick(hits.distance, kept),
        face=pick(hits.face, kept),
    )
    error = noise.deviation * normal_quantile(high_half(pick(bits, kept)))
    return found, torch.clamp(found.distance + error, min=0.0)


def points(
    hits: Hits, measured: Tensor, view: View, prisms: PrismTensors, pattern: Pattern
) -> Points:
    """The points of the hits that are reported.

    Args:
        hits: not lost.
        measured: range of each [m], shape (hit,).
        view: the faces that were hit.
        prisms: what the faces belong to.
        pattern: the rays.
    """
    x, y, z = (pick(component, hits.ray) for component in pattern.direction)
    nx, ny, nz = (pick(component, hits.face) for component in view.normal)
    prism = pick(view.prism, hits.face)
    cosine = -(x * nx + y * ny + z * nz)
    intensity = pick(prisms.reflectivity, prism) * cosine * torch.exp(-ATTENUATION * hits.distance)
    floats = torch.stack([measured * x, measured * y, measured * z, intensity], dim=1).float()
    instance = pick(prisms.instance, prism).int()[:, None]
    return Points(record=torch.cat([floats.view(torch.int32), instance], 1), sensor=hits.sensor)
