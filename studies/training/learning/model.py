"""The BEV network in PyTorch, for training; `fmus.driving.network` is the same in fixed point."""

from dataclasses import dataclass

import torch
from torch import Tensor, nn
from typing_extensions import override

from fmus.driving.network.architecture import Architecture
from fmus.driving.network.fixed_point import LARGEST
from fmus.driving.network.fusion import LENGTH_SCALE
from studies.training.learning.decision import Layers, decide


@dataclass(frozen=True, slots=True, kw_only=True)
class Seen:
    """Keypoints of a batch, as the fusion gets them.

    Attributes:
        image: 0 or 1, shape (batch, keypoint, INPUTS).
        place: inputs of the encoder, shape (batch, keypoint, 3).
        turn: by which vectors are turned into the ego's frame [rad], shape (batch, keypoint).
        geometry: see `fmus.driving.network.fusion.geometry`, shape (batch, keypoint, GEOMETRY).
        present: whether it is there and has arrived, shape (batch, keypoint).
    """

    image: Tensor
    place: Tensor
    turn: Tensor
    geometry: Tensor
    present: Tensor


@dataclass(frozen=True, slots=True, kw_only=True)
class Answer:
    """What the network says.

    Attributes:
        command: accelerate, brake, steer; not yet limited; shape (batch, 3).
        judgements: logits of vehicle and moving, shape (batch, keypoint, 2).
        velocity: the first vector of the features [m/s], in the sensor's frame,
            shape (batch, keypoint, 2).
    """

    command: Tensor
    judgements: Tensor
    velocity: Tensor


class DrivingModel(nn.Module):
    """BEV encoder, fusion and head of an architecture."""

    def __init__(self, architecture: Architecture) -> None:
        super().__init__()
        self.architecture = architecture
        self.layers = Layers(architecture.shapes)

    @override
    def forward(self, seen: Seen, ego: Tensor) -> Answer:
        """The command for each moment of a batch.

        Args:
            seen: the keypoints.
            ego: numbers about the ego vehicle, shape (batch, EGO).
        """
        layers = self.layers
        image = seen.image @ layers.weight("encoder.image.weight")
        hidden = torch.relu(image + layers.dense("encoder.place", seen.place)).clamp(max=LARGEST)
        judgements = layers.dense("encoder.judgements", hidden)
        features = layers.dense("encoder.features", hidden)
        scalars = self.architecture.features - 2 * self.architecture.vectors
        vectors = features[..., scalars:]
        cosine, sine = torch.cos(seen.turn)[..., None], torch.sin(seen.turn)[..., None]
        x, y = vectors[..., 0::2], vectors[..., 1::2]
        turned = torch.stack([x * cosine - y * sine, x * sine + y * cosine], dim=-1)
        inputs = torch.cat([torch.relu(features[..., :scalars]), turned.flatten(-2)], dim=-1)
        return Answer(
            command=decide(layers, inputs, seen.geometry, seen.present, ego),
            judgements=judgements,
            velocity=vectors[..., :2] * LENGTH_SCALE,
        )
