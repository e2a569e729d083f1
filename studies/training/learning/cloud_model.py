"""The driving network with a point transformer, for training."""

from collections.abc import Mapping

import torch
from torch import Tensor, nn
from typing_extensions import override

from fmus.driving.network.architecture import Architecture
from fmus.driving.network.fixed_point import LARGEST
from fmus.driving.network.fusion import LENGTH_SCALE
from fmus.driving.network.point_transformer import put_weights, weights_of
from fmus.driving.point_transformer import PointTransformerEncoder
from orchestrator.signal import Array
from studies.training.learning.cloud_lessons import CloudBatch
from studies.training.learning.decision import Layers, decide


class CloudDrivingModel(nn.Module):
    """Point transformer, fusion and head of an architecture.

    Args:
        architecture: of the network.
        seed: of the encoder's first weights.
    """

    def __init__(self, architecture: Architecture, seed: int) -> None:
        super().__init__()
        self.architecture = architecture
        self.encoder = PointTransformerEncoder(blocks=architecture.blocks, seed=seed)
        self.layers = Layers(architecture.decision_shapes)

    def weights(self) -> dict[str, Array]:
        """All arrays of a checkpoint by their names, in the shapes of the architecture, float64."""
        return {**weights_of(self.encoder), **self.layers.weights()}

    def load(self, weights: Mapping[str, Array]) -> None:
        """Take over the arrays of a checkpoint, in the shapes of the architecture."""
        put_weights(self.encoder, weights)
        self.layers.load(weights)

    @override
    def forward(self, batch: CloudBatch) -> Tensor:
        """The command for each moment: accelerate, brake, steer; not limited; shape (batch, 3)."""
        moments, scans = batch.cloud.shape
        rows = moments, scans * self.architecture.keypoints
        if len(batch.clouds) == 0:  # nobody has a scan
            positions = batch.clouds.new_zeros(1, self.architecture.keypoints, 3)
            features = positions.new_zeros(
                1, self.architecture.keypoints, self.architecture.features
            )
            distinct = batch.distinct.new_zeros(1)
        else:
            found = self.encoder(batch.clouds, batch.distinct)
            positions, features = found.positions, found.features.clamp(-LARGEST, LARGEST)
            distinct = batch.distinct
        keypoint = torch.arange(self.architecture.keypoints, device=distinct.device)
        present = batch.arrived & (keypoint < distinct[:, None])[batch.cloud]
        return decide(
            self.layers,
            features[batch.cloud].reshape(*rows, -1),
            _geometry(positions[batch.cloud], batch).reshape(*rows, -1),
            present.reshape(rows),
            batch.ego,
        )


def _geometry(positions: Tensor, batch: CloudBatch) -> Tensor:
    """`fmus.driving.network.fusion.geometry` of keypoints of shape (batch, scan, keypoint, 3)."""
    x, y, z = positions.unbind(-1)
    ahead, left, cosine, sine, height = batch.place[:, :, None].unbind(-1)
    lengths = torch.stack(
        [x * cosine - y * sine + ahead, x * sine + y * cosine + left, z + height], dim=-1
    )
    others = batch.circumstances[:, :, None].expand(-1, -1, x.shape[2], -1)
    return torch.cat([lengths / LENGTH_SCALE, others], dim=-1)
