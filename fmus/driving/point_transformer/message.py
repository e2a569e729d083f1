"""From a scan to a features message."""

import numpy as np
import torch
from torch import Tensor

from fmus.driving.point_transformer.cloud import POINTS, Crop, resample, thin
from fmus.driving.point_transformer.encoder import PointTransformerEncoder
from fmus.messages.features import FeaturesMessage
from orchestrator.signal import Array
from orchestrator.timebase import Time


def encode(
    encoder: PointTransformerEncoder,
    cloud: Tensor,
    *,
    crop: Crop,
    rng: np.random.Generator,
    points: int = POINTS,
) -> Array:
    """The keypoints of one scan by falling importance, each position once.

    Args:
        encoder: in evaluation mode, on any device.
        cloud: all points of the scan, levelled sensor frame [m], shape (point, 3).
        crop: which of them are read.
        rng: decides which are left out if there are too many; otherwise it has no say but in the
            last digits.
        points: that the encoder reads.

    Returns:
        Position [m] and features of each, float32, shape (keypoint, 3 + dimensions); fewer than
        the encoder's capacity if the cloud has so few voxels, none if no point is in the crop.

    Raises:
        ValueError: the cloud is no list of points, or the encoder is in training mode.
    """
    if encoder.training:
        raise ValueError("the encoder is in training mode; call its `eval` before encoding scans")
    with torch.inference_mode():
        weight = next(encoder.parameters())
        near = thin(cloud.to(weight.device, weight.dtype), crop)
        if len(near) == 0:
            return np.empty((0, 3 + encoder.dimensions), np.float32)
        distinct = torch.tensor([min(len(near), points)], device=near.device)
        found = encoder(resample(near, points, rng)[None], distinct)
        numbers = torch.cat([found.positions[0], found.features[0]], dim=1)
        return np.asarray(numbers[: len(near)].float().cpu().numpy())


def to_message(
    encoder: PointTransformerEncoder,
    keypoints: Array,
    *,
    vehicle: int,
    time: Time,
    position: Array,
    heading: float,
) -> FeaturesMessage:
    """What the sharer sends.

    Args:
        encoder: that made the keypoints.
        keypoints: of `encode`.
        vehicle: that carries the sensor.
        time: of the scan [ns].
        position: of the sensor, world frame [m], shape (3,).
        heading: of the sensor's x axis, counter-clockwise from east [rad].
    """
    return FeaturesMessage(
        vehicle=vehicle,
        time=time,
        position=np.asarray(position, np.float64),
        heading=heading,
        capacity=encoder.capacity(),
        dimensions=encoder.dimensions,
        keypoints=keypoints,
    )
