"""What all learned driving networks share: fusion, head, and the loss against the expert."""

from collections.abc import Mapping
from typing import Final

import numpy as np
import torch
from torch import Tensor, nn
from torch.nn import functional

from fmus.driving.network.fixed_point import LARGEST
from orchestrator.signal import Array


class Layers(nn.Module):
    """Dense layers by their names in a checkpoint, in PyTorch.

    Args:
        shapes: of the weights by name, inputs before outputs.
    """

    def __init__(self, shapes: Mapping[str, tuple[int, ...]]) -> None:
        super().__init__()
        self._names = tuple(shapes)
        for name, shape in shapes.items():
            value = torch.zeros(shape)
            if name.endswith("weight"):
                nn.init.kaiming_uniform_(value.T, a=2.0)
            self.register_parameter(name.replace(".", "_"), nn.Parameter(value))

    def weight(self, name: str) -> Tensor:
        """The weight with this name in `shapes`."""
        return self.get_parameter(name.replace(".", "_"))

    def weights(self) -> dict[str, Array]:
        """All weights by their names, in the shapes of `shapes`, float64."""
        return {
            name: self.weight(name).detach().cpu().numpy().astype(np.float64)
            for name in self._names
        }

    def load(self, weights: Mapping[str, Array]) -> None:
        """Take over weights, by their names and in the shapes of `shapes`.

        Others than these layers' may be among them.
        """
        with torch.no_grad():
            for name in self._names:
                self.weight(name).copy_(torch.as_tensor(weights[name]))

    def dense(self, name: str, inputs: Tensor) -> Tensor:
        """The outputs of the layer `name`, limited to what activations can be.

        Args:
            name: without the end `.weight` or `.bias`.
            inputs: shape (..., input).

        Returns:
            Shape (..., output).
        """
        result = inputs @ self.weight(f"{name}.weight") + self.weight(f"{name}.bias")
        return torch.clamp(result, -LARGEST, LARGEST)


def decide(
    layers: Layers, features: Tensor, geometry: Tensor, present: Tensor, ego: Tensor
) -> Tensor:
    """Fusion and head of `fmus.driving.network`, in floating point.

    Args:
        layers: with those of `Architecture.decision_shapes`.
        features: in the ego vehicle's frame, shape (batch, keypoint, features).
        geometry: see `fmus.driving.network.fusion.geometry`, shape (batch, keypoint, GEOMETRY).
        present: whether a keypoint is there and has arrived, shape (batch, keypoint).
        ego: numbers about the ego vehicle, shape (batch, EGO).

    Returns:
        Accelerate, brake, steer; not yet limited; shape (batch, 3).
    """
    fused = torch.relu(layers.dense("fusion.first", torch.cat([features, geometry], dim=-1)))
    fused = torch.relu(layers.dense("fusion.second", fused))
    pooled = (fused * present[..., None]).amax(dim=1)
    head = torch.relu(layers.dense("head.first", torch.cat([pooled, ego], dim=-1)))
    return layers.dense("head.second", head)


_TAKING_UP_SPEED: Final = 0.1
"""More of the accelerator than this is no correction of the speed."""
_WEIGHT_OF_TAKING_UP_SPEED: Final = 3.0
"""Such moments are rare, too; a network that misses them stays where it has stopped."""


def imitation_loss(
    command: Tensor, expert: Tensor, yields: Tensor, sees_threat: Tensor, yielding_weight: float
) -> Tensor:
    """Mean over a batch of the sum of absolute errors.

    Moments in which the expert yields to a vehicle that the network can see count
    `yielding_weight` times. Where it cannot see it they do not count at all: there is nothing to
    learn from them but fear of such places. Moments in which it takes up speed count three times.

    Args:
        command: of the network, shape (batch, 3).
        expert: its command, shape (batch, 3).
        yields: whether the expert yields to a vehicle, shape (batch,).
        sees_threat: whether the network can see that vehicle, shape (batch,).
        yielding_weight: at least 1.
    """
    speeding_up = expert[:, 0] > _TAKING_UP_SPEED
    weight = torch.where(speeding_up, _WEIGHT_OF_TAKING_UP_SPEED, 1.0)
    weight = torch.where(yields, yielding_weight * sees_threat, weight)
    error = functional.l1_loss(command, expert, reduction="none")
    return (error.sum(dim=1) * weight).sum() / weight.sum().clamp(min=1.0)
