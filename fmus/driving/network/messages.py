"""Keypoints on the air: from an encoder to a message, and back at the receiver."""

from typing import Final

import numpy as np

from fmus.driving.network.architecture import Architecture
from fmus.driving.network.cloud import Cloud
from fmus.driving.network.fixed_point import rounded
from fmus.driving.network.fusion import Observed
from fmus.driving.network.keypoints import Keypoints
from fmus.messages.features import COORDINATES, FeaturesMessage
from fmus.physics.plane import Frame
from orchestrator.timebase import Time

_NANOSECONDS: Final = 1e9


def to_message(
    cloud: Cloud, keypoints: Keypoints, architecture: Architecture, encoder: int
) -> FeaturesMessage:
    """What a sharer sends of a scan.

    Args:
        cloud: the scan.
        keypoints: of it.
        architecture: of the network that made them.
        encoder: of the network that made them, `Checkpoint.encoder`.
    """
    numbers = np.empty((len(keypoints.x), COORDINATES + architecture.features), np.float32)
    numbers[:, 0], numbers[:, 1] = keypoints.x, keypoints.y
    numbers[:, 2] = keypoints.z - cloud.height
    numbers[:, COORDINATES:] = keypoints.features
    return FeaturesMessage(
        vehicle=cloud.vehicle,
        time=cloud.time,
        position=np.array([cloud.frame.x, cloud.frame.y, cloud.height]),
        heading=cloud.frame.heading,
        capacity=architecture.keypoints,
        dimensions=architecture.features,
        keypoints=numbers,
        encoder=encoder,
    )


def to_observed(message: FeaturesMessage, now: Time) -> Observed:
    """What a message tells at `now` [ns]; a message may be partial."""
    numbers = message.keypoints.astype(np.float64)
    return Observed(
        frame=Frame.at(message.position, message.heading),
        x=rounded(numbers[:, 0]),
        y=rounded(numbers[:, 1]),
        z=rounded(numbers[:, 2] + message.position[2]),
        features=rounded(numbers[:, COORDINATES:]),
        age=(now - message.time) / _NANOSECONDS,
        own=False,
    )


def seen(cloud: Cloud, keypoints: Keypoints, now: Time) -> Observed:
    """What the ego vehicle's own scan tells at `now` [ns]."""
    return Observed(
        frame=cloud.frame,
        x=rounded(keypoints.x),
        y=rounded(keypoints.y),
        z=rounded(keypoints.z),
        features=keypoints.features,
        age=(now - cloud.time) / _NANOSECONDS,
        own=True,
    )
