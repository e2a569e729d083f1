"""What the encoder reads of a scan: a fixed number of points, at most one per voxel.

The published preprocessing (Cui et al., COOPERNAUT, CVPR 2022): crop, one point per voxel of
0.5 m, then a random choice of 2048 points, or all and some of them again. Where it leaves open
which point of a voxel stays, here the one nearest to the voxel's centre does, so that nothing
depends on the order of the points.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np
import torch
from torch import Tensor

POINTS: Final = 2048
"""Points that the encoder reads of a scan."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Crop:
    """Which points are read, in the levelled sensor frame; limits included.

    Attributes:
        half_width: largest |x| and |y| [m].
        bottom, top: of z, from the sensor [m]; as published, for a sensor half a metre above the
            roof of a car: from below the ground to 0.2 m above that roof.
        voxel: side of the cubes of which one point each is kept [m].

    Raises:
        ValueError: nothing can lie within.
    """

    half_width: float = 70.0
    bottom: float = -2.5
    top: float = -0.3
    voxel: float = 0.5

    def __post_init__(self) -> None:
        for name in ("half_width", "voxel"):
            if not 0.0 < getattr(self, name) < float("inf"):
                raise ValueError(f"{name} is {getattr(self, name):g}; it must be a length above 0")
        if not -float("inf") < self.bottom < self.top < float("inf"):
            raise ValueError(
                f"bottom {self.bottom:g} m must be below top {self.top:g} m, both finite"
            )
        longest = max(2.0 * self.half_width, self.top - self.bottom)
        if longest / self.voxel > _MOST_CELLS:
            raise ValueError(
                f"voxel is {self.voxel:g} m, too small for a crop of {longest:g} m; the smallest "
                f"is {longest / _MOST_CELLS:g} m"
            )


_CELL_BITS: Final = 20
_MOST_CELLS: Final = 2**_CELL_BITS - 2
"""Voxels per axis: three indices share an int64."""


def thin(cloud: Tensor, crop: Crop) -> Tensor:
    """One point of each voxel that has any: the nearest to the centre.

    Args:
        cloud: levelled sensor frame [m], shape (point, 3), floating point; any order.
        crop: what is read.

    Returns:
        Some of the points, shape (voxel, 3), in an order that the points alone decide.

    Raises:
        ValueError: the shape is another, or a coordinate is not finite.
    """
    _check_cloud(cloud)
    x, y, z = cloud.unbind(1)
    within = (x.abs() <= crop.half_width) & (y.abs() <= crop.half_width)
    near = cloud[within & (z >= crop.bottom) & (z <= crop.top)]
    if len(near) == 0:
        return near
    corner = near.new_tensor([-crop.half_width, -crop.half_width, crop.bottom])
    place = (near - corner) / crop.voxel  # [voxels]
    cell = place.floor()
    x, y, z = cell.long().unbind(1)
    voxel, index = torch.unique((x << _CELL_BITS | y) << _CELL_BITS | z, return_inverse=True)
    distance = (place - cell - 0.5).square().sum(1)
    least = distance.new_full((len(voxel),), torch.inf)
    least = least.scatter_reduce(0, index, distance, "amin")
    nearest = distance == least[index]
    return _first_of_each_voxel(near[nearest], index[nearest])


def _check_cloud(cloud: Tensor) -> None:
    if cloud.dim() != 2 or cloud.shape[1] != 3 or not cloud.is_floating_point():
        raise ValueError(
            f"a cloud of shape {tuple(cloud.shape)} and type {cloud.dtype} is no list of points; "
            "give floating-point x, y and z, shape (point, 3)"
        )
    finite = torch.isfinite(cloud).all(dim=1)
    if not bool(finite.all()):
        row = int(torch.nonzero(~finite)[0, 0])
        raise ValueError(
            f"point {row} of the cloud is {cloud[row].tolist()}; coordinates must be finite"
        )


def _first_of_each_voxel(point: Tensor, voxel: Tensor) -> Tensor:
    """Sorted by voxel; among equally near points the first by x, then y, then z."""
    for axis in (2, 1, 0):
        order = torch.sort(point[:, axis], stable=True).indices
        point, voxel = point[order], voxel[order]
    voxel, order = torch.sort(voxel, stable=True)
    is_first = torch.cat([voxel.new_ones(1, dtype=torch.bool), voxel[1:] != voxel[:-1]])
    return point[order][is_first]


def resample(points: Tensor, count: int, rng: np.random.Generator) -> Tensor:
    """So many points in random order: a random choice, or all of them and some again.

    Repeated points come last, so the first `n` are distinct if there are `n`.

    Args:
        points: shape (point, 3), at least one.
        count: how many are wanted, at least 1.
        rng: decides; equal states give equal results on every device.

    Returns:
        Shape (count, 3).

    Raises:
        ValueError: there is no point.
    """
    if len(points) == 0:
        raise ValueError(
            "there is no point within the crop; a scan without points makes no keypoints"
        )
    order = rng.permutation(len(points))[:count]
    again = rng.integers(len(points), size=count - len(order))
    index = torch.from_numpy(np.concatenate([order, again]))
    return points.index_select(0, index.to(points.device))
