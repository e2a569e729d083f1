"""Which points become keypoints.

Every sampling here is nested: the first m of n chosen points are what a choice of m would be, so
that the encoder samples once for all its levels.
"""

import abc
from dataclasses import dataclass

import torch
from torch import Tensor
from typing_extensions import override


class Sampling(abc.ABC):
    """Chooses and orders points of clouds.

    If the points end with repeats of earlier ones, so do the chosen ones.
    """

    @abc.abstractmethod
    def choose(self, positions: Tensor, count: int) -> Tensor:
        """Indices of the chosen points by falling importance.

        Args:
            positions: [m], shape (cloud, point, 3).
            count: how many, at most as many as there are points.

        Returns:
            int64, shape (cloud, count).
        """


@dataclass(frozen=True, slots=True)
class FarthestPoints(Sampling):
    """Each further point is the farthest from those chosen (Qi et al., PointNet++, 2017, 3.2).

    The first is the farthest from the middle of the bounding box, so that neither the order of
    the points nor repeated points have a say. Repeated points are chosen when no others are left.
    """

    @override
    @torch.no_grad()
    def choose(self, positions: Tensor, count: int) -> Tensor:
        coordinates = positions.transpose(1, 2).contiguous()  # (cloud, 3, point)
        middle = (coordinates.amin(2, keepdim=True) + coordinates.amax(2, keepdim=True)) / 2
        offset = torch.empty_like(coordinates)

        def squared_distance(place: Tensor) -> Tensor:
            torch.sub(coordinates, place, out=offset)
            return offset.square_().sum(1)

        chosen = [squared_distance(middle).argmax(1, keepdim=True)]
        # of each point from the chosen ones [m^2]
        distance = positions.new_full(positions.shape[:2], torch.inf)
        while len(chosen) < count:
            last = coordinates.gather(2, chosen[-1][:, None].expand(-1, 3, 1))
            torch.minimum(distance, squared_distance(last), out=distance)
            chosen.append(distance.argmax(1, keepdim=True))
        return torch.cat(chosen, 1)


@dataclass(frozen=True, slots=True)
class FirstPoints(Sampling):
    """The first points: a random choice, if their order is random as after `cloud.resample`."""

    @override
    def choose(self, positions: Tensor, count: int) -> Tensor:
        return torch.arange(count, device=positions.device).expand(len(positions), count)
