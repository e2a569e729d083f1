"""The encoder: from a cloud to keypoints with features."""

from dataclasses import dataclass
from typing import Final

import torch
from torch import Tensor, nn
from typing_extensions import override

from fmus.driving.point_transformer.cloud import POINTS
from fmus.driving.point_transformer.layers import TransitionDown, VectorAttention
from fmus.driving.point_transformer.neighbours import gather, nearest
from fmus.driving.point_transformer.sampling import FarthestPoints, Sampling

NEIGHBOURS: Final = 16
"""Points that a point attends to, itself included."""
EMBEDDING: Final = 32
"""Channels of the features of single points; every down-sampling doubles them."""
REDUCTION: Final = 4
"""Every down-sampling divides the number of points by this one."""
_FLOAT_SIZE: Final = 4


@dataclass(frozen=True, slots=True, kw_only=True)
class Keypoints:
    """What the encoder makes of clouds, by falling importance.

    Attributes:
        positions: levelled sensor frame [m], shape (cloud, keypoint, 3).
        features: shape (cloud, keypoint, dimensions).
    """

    positions: Tensor
    features: Tensor


class PointTransformerEncoder(nn.Module):
    """An embedding, a vector attention, and `blocks` times a transition down and an attention.

    With 2048 points and two blocks 512 x 64, then 128 x 128 (as COOPERNAUT published, CVPR 2022);
    the third block makes 32 x 256 of it. The embedding reads positions, so features depend on where
    a point lies from the sensor; the layers behind it read differences only.

    Args:
        blocks: how often the points are down-sampled, 2 or 3.
        seed: of the first weights; PyTorch's own random state is left alone.
        sampling: which points become keypoints.

    Raises:
        ValueError: there is no such shape.
    """

    def __init__(self, *, blocks: int = 2, seed: int = 0, sampling: Sampling | None = None) -> None:
        super().__init__()
        if blocks not in {2, 3}:
            raise ValueError(
                f"blocks is {blocks}; it must be 2 (messages of 67072 bytes) or 3 (33152 bytes)"
            )
        self.blocks = blocks
        self.sampling = FarthestPoints() if sampling is None else sampling
        width = [EMBEDDING << level for level in range(blocks + 1)]
        with torch.random.fork_rng(devices=[]):
            torch.default_generator.manual_seed(seed)
            self.embedding = nn.Sequential(
                nn.Linear(3, EMBEDDING), nn.ReLU(), nn.Linear(EMBEDDING, EMBEDDING)
            )
            self.down = nn.ModuleList(map(TransitionDown, width[:-1], width[1:]))
            self.attention = nn.ModuleList(map(VectorAttention, width))

    @property
    def dimensions(self) -> int:
        """Features of a keypoint."""
        return EMBEDDING << self.blocks

    def capacity(self, points: int = POINTS) -> int:
        """Keypoints of clouds with so many points."""
        return int(points // REDUCTION**self.blocks)

    def message_size(self, points: int = POINTS) -> int:
        """Bytes of all keypoints: positions and features, float32 each."""
        return self.capacity(points) * (3 + self.dimensions) * _FLOAT_SIZE

    @override
    def forward(self, positions: Tensor, distinct: Tensor | None = None) -> Keypoints:
        """Encode clouds.

        Args:
            positions: levelled sensor frame [m], shape (cloud, point, 3); as `cloud.resample`
                leaves them.
            distinct: so many points of each cloud are no repeats, the first ones, int64, shape
                (cloud,), at least 1; by default none is a repeat. Repeats have no say in the
                features of others. So many keypoints, the first ones, are no repeats either.

        Raises:
            ValueError: a shape is another, or the number of points does not suit.
        """
        self._check(positions, distinct)
        features = self.embedding(positions)
        neighbours = nearest(positions, positions, NEIGHBOURS, distinct)
        features = self.attention[0](positions, features, neighbours)
        chosen = self.sampling.choose(positions, positions.shape[1] // REDUCTION)
        for down, attention in zip(self.down, self.attention[1:], strict=True):
            centres = gather(positions, chosen)
            # the neighbours of a centre are known: it is one of the points
            features = down(positions, features, centres, gather(neighbours, chosen))
            neighbours = nearest(centres, centres, NEIGHBOURS, distinct)
            features = attention(centres, features, neighbours)
            positions = centres
            # now in the order of the sampling, which is nested
            fewer = torch.arange(positions.shape[1] // REDUCTION, device=positions.device)
            chosen = fewer.expand(len(positions), -1)
        return Keypoints(positions=positions, features=features)

    def _check(self, positions: Tensor, distinct: Tensor | None) -> None:
        if positions.dim() != 3 or positions.shape[2] != 3 or len(positions) == 0:
            raise ValueError(
                f"clouds of shape {tuple(positions.shape)} are no batch; give x, y and z, shape "
                "(cloud, point, 3)"
            )
        if distinct is not None and distinct.shape != positions.shape[:1]:
            raise ValueError(
                f"distinct has the shape {tuple(distinct.shape)}; give one number for each of "
                f"{len(positions)} clouds"
            )
        points, step = positions.shape[1], REDUCTION**self.blocks
        if points % step or points < NEIGHBOURS * step:
            raise ValueError(
                f"clouds of {points} points cannot be down-sampled {self.blocks} times; resample "
                f"them to a multiple of {step}, at least {NEIGHBOURS * step}"
            )
