"""What each ray hits first."""

from dataclasses import dataclass

import torch
from torch import Tensor

from fmus.lidar.gpu.crossing import segments
from fmus.lidar.gpu.pattern import Pattern
from fmus.lidar.gpu.ragged import expand, pick
from fmus.lidar.gpu.view import View


@dataclass(frozen=True, slots=True, kw_only=True)
class Hits:
    """The rays that hit something, by sensor, azimuth and channel; shape (hit,) each.

    Attributes:
        sensor: int64.
        ray: in the pattern, int64.
        distance: along the ray [m].
        face: in the view, int64.
    """

    sensor: Tensor
    ray: Tensor
    distance: Tensor
    face: Tensor


@dataclass(frozen=True, slots=True, kw_only=True)
class _Candidates:
    """Faces that rays meet, one after another; shape (candidate,) each.

    Attributes:
        ray: over all sensors, int64.
        face: in the view, int64.
        distance: along the ray [m].
    """

    ray: Tensor
    face: Tensor
    distance: Tensor


def first_hits(view: View, height: Tensor, pattern: Pattern) -> Hits:
    """The nearest surface of each ray, within the range.

    Of surfaces at equal distances the ground is hit, otherwise the first in the view.

    Args:
        view: the faces.
        height: of the sensors over the ground [m], shape (sensor,).
        pattern: the rays.
    """
    limit = _ground(height, pattern)
    found = _candidates(view, pattern, limit)
    nearest = limit.scatter_reduce(0, found.ray, found.distance, "amin")
    winner = torch.nonzero(found.distance == pick(nearest, found.ray))[:, 0]
    face = torch.full_like(limit, view.ground, dtype=torch.int64)
    face.scatter_reduce_(0, pick(found.ray, winner), pick(found.face, winner), "amin")
    some = nearest.view(len(height), pattern.rays) < pattern.reach
    sensor, ray = torch.nonzero(some, as_tuple=True)
    hit = sensor * pattern.rays + ray
    return Hits(sensor=sensor, ray=ray, distance=pick(nearest, hit), face=pick(face, hit))


def _ground(height: Tensor, pattern: Pattern) -> Tensor:
    """Distance of the ground along each ray [m], or the range; shape (sensor * ray,)."""
    distance = -height[:, None] / torch.where(pattern.up < 0.0, pattern.up, -1e-300)
    seen = (height[:, None] > 0.0) & (pattern.up < 0.0) & (distance < pattern.reach)
    return torch.where(seen, distance, pattern.reach).flatten()


def _candidates(view: View, pattern: Pattern, limit: Tensor) -> _Candidates:
    """Everything nearer than `limit`, shape (sensor * ray,)."""
    found = segments(view, pattern)
    face, azimuth = found.face, found.azimuth
    x, y, z = (pick(component, face) for component in view.normal)
    # the level part of the normal, along the azimuth
    ahead = x * pick(pattern.azimuth_x, azimuth) + y * pick(pattern.azimuth_y, azimuth)
    column = (pick(view.sensor, face) * pattern.azimuths + azimuth) * pattern.channels
    segment, number = expand(found.count)
    channel = pick(found.first, segment) + number
    ray = pick(column, segment) + channel
    level, rise = pick(pattern.level, channel), pick(pattern.rise, channel)
    approach = level * pick(ahead, segment) + rise * pick(z, segment)
    distance = pick(pick(view.offset, face), segment) / approach
    # an edge-on face may seem to be turned away, by rounding: it is not hit
    nearer = torch.nonzero((approach < 0.0) & (distance < pick(limit, ray)))[:, 0]
    return _Candidates(
        ray=pick(ray, nearer),
        face=pick(pick(face, segment), nearer),
        distance=pick(distance, nearer),
    )
