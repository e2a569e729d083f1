"""One interface for all encoders: one object per sensor, which may remember earlier scans."""

import abc
from collections.abc import Sequence
from typing import Final

import numpy as np
from typing_extensions import override

from fmus.driving.network.architecture import POINT_TRANSFORMER
from fmus.driving.network.checkpoint import Checkpoint, require_installed
from fmus.driving.network.cloud import Cloud
from fmus.driving.network.encoder import BevEncoder
from fmus.driving.network.keypoints import Keypoints
from fmus.driving.network.messages import to_message
from fmus.driving.network.patches import History
from fmus.driving.network.scan import scan_of
from fmus.messages.features import FeaturesMessage
from fmus.physics.plane import Frame
from orchestrator.signal import Array

RAW_POINTS: Final = 65_536
"""Capacity of a message of raw points: the rays of a scan with 64 channels and 1024 azimuths."""


class SensorEncoder(abc.ABC):
    """The encoder of one lidar."""

    @abc.abstractmethod
    def encode(self, cloud: Cloud, others: Sequence[Cloud] = ()) -> Keypoints:
        """Keypoints of the next scan, by falling importance.

        Args:
            cloud: the scan; later than the one before, or a new beginning.
            others: the newest scans of other sensors, for an encoder of several clouds at once.
        """


class BevSensor(SensorEncoder):
    """The BEV encoder with its history; scans of others are laid over the own ones."""

    def __init__(self, checkpoint: Checkpoint) -> None:
        self._encoder = BevEncoder(checkpoint.architecture, checkpoint.weights)
        self._history = History()
        self._others: dict[int, History] = {}

    @override
    def encode(self, cloud: Cloud, others: Sequence[Cloud] = ()) -> Keypoints:
        self._history.add(scan_of(cloud))
        self._others = {o.vehicle: self._others.get(o.vehicle, History()) for o in others}
        for other in others:
            self._others[other.vehicle].add(scan_of(other))
        stacks = [history.stack for history in self._others.values()]
        return self._encoder.encode(self._history.stack, stacks)


def sensor_encoder(checkpoint: Checkpoint) -> SensorEncoder:
    """A new encoder of the kind that `checkpoint` is of, for one sensor.

    Raises:
        ComponentTypeError: it needs PyTorch, which is not installed.
    """
    require_installed(checkpoint.architecture)
    if checkpoint.architecture.encoder == POINT_TRANSFORMER:
        from fmus.driving.network.point_transformer import PointTransformerSensor  # noqa: PLC0415 - PyTorch

        return PointTransformerSensor(checkpoint)
    return BevSensor(checkpoint)


class Sender:
    """What one vehicle sends of each of its scans: keypoints with features, or all its points."""

    def __init__(self, checkpoint: Checkpoint) -> None:
        self._architecture = checkpoint.architecture
        self._encoder = None if self._architecture.early else sensor_encoder(checkpoint)
        self._number = checkpoint.encoder

    def message(self, cloud: Cloud) -> FeaturesMessage:
        """The message about the next scan."""
        if self._encoder is None:
            return raw_message(cloud)
        keypoints = self._encoder.encode(cloud)
        return to_message(cloud, keypoints, self._architecture, self._number)


def raw_message(cloud: Cloud) -> FeaturesMessage:
    """All points of a scan, as keypoints without features; beyond the capacity evenly thinned."""
    count = len(cloud.x)
    rows = np.linspace(0, count - 1, min(count, RAW_POINTS)).astype(np.int64)
    points = np.stack([cloud.x, cloud.y, cloud.z], axis=1).astype(np.float32)
    return FeaturesMessage(
        vehicle=cloud.vehicle,
        time=cloud.time,
        position=np.array([cloud.frame.x, cloud.frame.y, cloud.height]),
        heading=cloud.frame.heading,
        capacity=RAW_POINTS,
        dimensions=0,
        keypoints=points[rows],
    )


def raw_cloud(message: FeaturesMessage) -> Cloud:
    """The scan in a message of raw points, as far as it arrived."""
    x, y, z = np.asarray(message.keypoints, np.float32)[:, :3].T
    position: Array = message.position
    return Cloud(
        vehicle=message.vehicle,
        time=message.time,
        frame=Frame.at(position, message.heading),
        height=float(position[2]),
        x=x,
        y=y,
        z=z,
    )
