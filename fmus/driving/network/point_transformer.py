"""The point transformer as the encoder of a driving network; with PyTorch (extra `torch`).

Its results are those of PyTorch's kernels, so not the same bits on every machine.
"""

from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np
import torch
from torch import Tensor
from typing_extensions import override

from fmus.driving.network.checkpoint import Checkpoint
from fmus.driving.network.cloud import Cloud
from fmus.driving.network.fixed_point import rounded
from fmus.driving.network.keypoints import Keypoints
from fmus.driving.network.point_transformer_shapes import PREFIX
from fmus.driving.network.sensors import SensorEncoder
from fmus.driving.point_transformer import Crop, PointTransformerEncoder, encode, thin
from orchestrator.signal import Array

CENTIMETRE: Final = 0.01
"""The unit in which coordinates of recorded points are written [m]."""
_CROP: Final = Crop()


class PointTransformerSensor(SensorEncoder):
    """The point transformer, on the CPU; it remembers nothing of earlier scans.

    PyTorch computes with one thread in this process from then on.

    Args:
        checkpoint: of a network with this encoder, with all tensors that its architecture names.
    """

    def __init__(self, checkpoint: Checkpoint) -> None:
        torch.set_num_threads(1)
        self._points = checkpoint.architecture.points
        self._encoder = PointTransformerEncoder(blocks=checkpoint.architecture.blocks)
        put_weights(self._encoder, checkpoint.weights)
        self._encoder.eval()

    @override
    def encode(self, cloud: Cloud, others: Sequence[Cloud] = ()) -> Keypoints:
        numbers = encode(
            self._encoder, _points(cloud), crop=_CROP, rng=_generator(cloud), points=self._points
        ).astype(np.float64)
        return Keypoints(
            x=numbers[:, 0],
            y=numbers[:, 1],
            z=numbers[:, 2] + cloud.height,
            features=rounded(numbers[:, 3:]),
        )


def weights_of(encoder: PointTransformerEncoder) -> dict[str, Array]:
    """Weights and the statistics of the batch normalisation, by their names in a checkpoint.

    They are float64, in the shapes of `point_transformer_shapes.tensors`.
    """
    return {
        PREFIX + name: value.detach().cpu().numpy().astype(np.float64)
        for name, value in encoder.state_dict().items()
        if value.is_floating_point()  # the others count batches, for nobody
    }


def put_weights(encoder: PointTransformerEncoder, weights: Mapping[str, Array]) -> None:
    """Give `encoder` the weights that `weights_of` got from one of its form.

    Args:
        encoder: is changed in place.
        weights: by their names in a checkpoint, in the shapes of
            `point_transformer_shapes.tensors`; others may be among them.
    """
    for name, value in encoder.state_dict().items():
        if value.is_floating_point():
            value.copy_(torch.as_tensor(weights[PREFIX + name]))


def recorded_points(cloud: Cloud, count: int) -> Array:
    """What is kept of a scan for training: one point of each voxel that the encoder reads.

    Args:
        cloud: the scan.
        count: at most so many, of which chance decides.

    Returns:
        Levelled sensor frame [cm], int16, shape (point, 3), in random order.
    """
    near = thin(_points(cloud), _CROP).numpy()
    chosen = _generator(cloud).permutation(len(near))[:count]
    return np.rint(near[chosen] / CENTIMETRE).astype(np.int16)


def _points(cloud: Cloud) -> Tensor:
    return torch.from_numpy(np.stack([cloud.x, cloud.y, cloud.z], axis=1).astype(np.float32))


def _generator(cloud: Cloud) -> np.random.Generator:
    """The generator of this scan alone: nothing depends on what was encoded before."""
    return np.random.default_rng([cloud.vehicle % 2**64, cloud.time])
