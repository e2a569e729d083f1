"""Which points are near which, in batches of clouds."""

from typing import Final

import torch
from torch import Tensor

_CACHED: Final = 2**17
"""So many squared distances are held at a time on a CPU: 512 KiB, which stay in the cache."""
_HELD: Final = 2**26
"""So many are held at a time elsewhere, where few large operations are quicker: 256 MiB."""


def squared_distances(query: Tensor, points: Tensor) -> Tensor:
    """Squares of all distances, from differences of coordinates.

    |a|^2 + |b|^2 - 2 a.b by a matrix product would be no faster in blocks, and would lose digits:
    at 70 m from the origin it is wrong by some 1e-3 m^2 in float32.

    Args:
        query: [m], shape (cloud, query, 3).
        points: [m], shape (cloud, point, 3).

    Returns:
        [m^2], shape (cloud, query, point).
    """
    a, b = query.transpose(1, 2)[..., None], points.transpose(1, 2).contiguous()[:, :, None]
    square = (a[:, 0] - b[:, 0]).square_()
    for axis in (1, 2):
        difference = a[:, axis] - b[:, axis]
        square.addcmul_(difference, difference)
    return square


@torch.no_grad()
def nearest(query: Tensor, points: Tensor, count: int, distinct: Tensor | None = None) -> Tensor:
    """The nearest points of each query point, itself included if it is one of them.

    Args:
        query: [m], shape (cloud, query, 3).
        points: [m], shape (cloud, point, 3), at least `count` of them.
        count: how many neighbours.
        distinct: so many points of each cloud count, the first ones; the others are no neighbours.
            int64, shape (cloud,), at least 1; by default all count.

    Returns:
        Indices of the points by growing distance, int64, shape (cloud, query, count). Among equal
        distances the order is arbitrary. Where fewer than `count` points count, the nearest stands
        in for those that are missing.
    """
    ignored = None if distinct is None else _repeats(points, distinct)
    block = _CACHED if points.device.type == "cpu" else _HELD
    rows = max(block // (points.shape[0] * points.shape[1]), 1)
    found = []
    for first in range(0, query.shape[1], rows):
        square = squared_distances(query[:, first : first + rows], points)
        if ignored is not None:
            square.masked_fill_(ignored, torch.inf)
        found.append(square.topk(count, dim=2, largest=False).indices)
    index = torch.cat(found, dim=1)
    if distinct is None:
        return index
    return torch.where(index < distinct[:, None, None], index, index[:, :, :1])


def _repeats(points: Tensor, distinct: Tensor) -> Tensor:
    """Which points do not count, bool, shape (cloud, 1, point)."""
    return torch.arange(points.shape[1], device=points.device) >= distinct[:, None, None]


def gather(values: Tensor, index: Tensor) -> Tensor:
    """The rows with these indices.

    Args:
        values: shape (cloud, point, channel).
        index: int64, shape (cloud, ...).

    Returns:
        Shape (cloud, ..., channel).
    """
    clouds, points = values.shape[:2]
    first = torch.arange(0, clouds * points, points, device=values.device)
    flat = (index + first.view(-1, *[1] * (index.dim() - 1))).flatten()
    return values.flatten(0, 1).index_select(0, flat).view(*index.shape, -1)
