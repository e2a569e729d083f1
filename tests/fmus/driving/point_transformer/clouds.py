"""Clouds for the tests."""

import torch
from torch import Tensor


def cloud(points: int = 2048, *, seed: int = 0, clouds: int = 1) -> Tensor:
    """Uniform in a slab around the sensor [m], float32, shape (clouds, points, 3)."""
    generator = torch.Generator().manual_seed(seed)
    unit = torch.rand(clouds, points, 3, generator=generator)
    return (unit - 0.5) * torch.tensor([100.0, 100.0, 2.0]) - torch.tensor([0.0, 0.0, 1.4])


def shuffled(points: Tensor, *, seed: int = 1) -> tuple[Tensor, Tensor]:
    """The points of all clouds in another order, and where each was, shape (point,)."""
    order = torch.randperm(points.shape[-2], generator=torch.Generator().manual_seed(seed))
    return points[..., order, :], order
