"""Driving by a trained network: own scans and received features in, the command out."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TypeAlias

import numpy as np
from typing_extensions import override

from fmus.driving.network.architecture import Architecture
from fmus.driving.network.checkpoint import Checkpoint, read_network, shipped
from fmus.driving.network.cloud import Cloud, clouds
from fmus.driving.network.driver import DrivingNetwork
from fmus.driving.network.fusion import Observed
from fmus.driving.network.messages import seen, to_observed
from fmus.driving.network.sensors import raw_cloud, sensor_encoder
from fmus.driving.policy.base import DrivingPolicy
from fmus.driving.policy.brake_hold import BrakeHold
from fmus.driving.policy.command import Command
from fmus.driving.policy.connectors import EGO
from fmus.driving.policy.inputs import Inputs
from fmus.messages.features import FeaturesMessage, read_features
from fmus.physics.plane import Frame
from orchestrator.parameters import parameter
from orchestrator.signal import Array
from orchestrator.timebase import Duration, Time, nanoseconds


def network_reads(architecture: Architecture) -> frozenset[str]:
    """Names of the inputs that a network reads."""
    alone = EGO - {"ego.size"} | {"points"}
    return alone | {"received.features"} if architecture.cooperative else alone


class NetworkDriver:
    """A network in the driver's seat: it remembers scans and reads each message once.

    Args:
        checkpoint: of the network.
        wanted_speed: where nothing is in the way [m/s].
        maximum_age: older scans, the own one and those of messages, are not used [ns].

    Raises:
        ValueError: the weights are too large for the fixed point.
    """

    def __init__(self, checkpoint: Checkpoint, wanted_speed: float, maximum_age: Duration) -> None:
        self._architecture = checkpoint.architecture
        self._number = checkpoint.encoder
        self._encoder = sensor_encoder(checkpoint)
        self._network = DrivingNetwork(checkpoint.architecture, checkpoint.weights)
        self._wanted_speed = wanted_speed
        self._maximum_age = maximum_age
        self._points = b""
        self._own: Observed | None = None
        self._scanned: Time = 0
        self._features = b""
        self._messages: Sequence[FeaturesMessage] = ()

    def command(self, inputs: Inputs, now: Time) -> Array:
        """Accelerate 0..1, brake 0..1 and steer -1..1, shape (3,).

        Args:
            inputs: what the policy knows at `now`.
            now: the communication point [ns].

        Raises:
            ValueError: a message is none of this network.
        """
        ego = inputs.ego
        if not ego.has_route:
            return np.zeros(3)
        if self._architecture.cooperative:
            self._listen(inputs.features)
        self._look(ego.vehicle, inputs.points, now)
        return self._network.drive(
            self._observed(now),
            frame=Frame.at(ego.position, ego.heading),
            speed=ego.speed,
            wanted_speed=self._wanted_speed,
            route=ego.route,
        )

    def _listen(self, features: bytes) -> None:
        """Read the messages, where they are new."""
        if features == self._features:
            return
        self._messages = read_features(features)
        for message in self._messages:
            check_message(message, self._architecture, self._number)
        self._features = features

    def _look(self, ego: int, points: bytes, now: Time) -> None:
        """Encode the ego vehicle's scan, where it is new."""
        if points == self._points:
            return
        self._points = points
        for cloud in clouds(points):
            if cloud.vehicle == ego:
                self._own = seen(cloud, self._encoder.encode(cloud, self._shared(now)), cloud.time)
                self._scanned = cloud.time

    def _shared(self, now: Time) -> list[Cloud]:
        """The newest cloud of each sender, for a network that encodes them with the own one."""
        if not self._architecture.early:
            return []
        newest = {message.vehicle: message for message in self._fresh(now)}  # in order of time
        return [raw_cloud(message) for message in newest.values()]

    def _fresh(self, now: Time) -> list[FeaturesMessage]:
        return [m for m in self._messages if now - m.time <= self._maximum_age]

    def _observed(self, now: Time) -> list[Observed]:
        messages = [] if self._architecture.early else self._fresh(now)
        observed = [to_observed(message, now) for message in messages]
        if self._own is not None and now - self._scanned <= self._maximum_age:
            observed.insert(0, replace(self._own, age=(now - self._scanned) / 1e9))
        return observed


def check_message(message: FeaturesMessage, architecture: Architecture, encoder: int) -> None:
    """Refuse features that another network has made.

    Args:
        message: with the features.
        architecture: of the network that is to read them.
        encoder: that it was trained with, `Checkpoint.encoder`.

    Raises:
        ValueError: they have other dimensions, or another encoder has made them.
    """
    if message.dimensions != architecture.dimensions:
        raise ValueError(
            f"vehicle {message.vehicle} sends {message.dimensions} features per keypoint, and this "
            f"network reads {architecture.dimensions}: give encoder and policy the same `network`"
        )
    if message.encoder != encoder:
        raise ValueError(
            f"vehicle {message.vehicle} sends features of another encoder than the one that this "
            "network was trained with: give encoder and policy the same `network`"
        )


class Network(DrivingPolicy):
    """Drives by a trained network: its own lidar, and what the channel delivered of others'.

    Encoder, fusion and head are one network, trained together: the component `encoder` of the
    sharers must be given the same `network`. docs/physics-policy.md describes it; `nlosim train`
    makes one.
    """

    @dataclass(frozen=True, slots=True, kw_only=True)
    class _Parameters:
        """Parameters of the network policy."""

        network: str | Path = parameter(
            "bev-32",
            doc="a network that comes with the package, or the path of a checkpoint",
            names=shipped,
        )
        cruise_speed: float = parameter(30.0 / 3.6, unit="m/s", minimum=0.1, doc="speed to keep")
        maximum_age: float = parameter(
            1.0, unit="s", minimum=0.01, doc="older scans and features of such are not used"
        )
        brake_hold: float = parameter(
            0.0, unit="s", minimum=0.0, doc="for how long it keeps to what it braked, at least"
        )

    Parameters: TypeAlias = _Parameters

    def __init__(self, parameters: _Parameters) -> None:
        self._parameters = parameters
        self._checkpoint = read_network(parameters.network)
        self._reads = network_reads(self._checkpoint.architecture)

    @property
    @override
    def reads(self) -> frozenset[str]:
        return self._reads

    @override
    def begin(self, start: Time, rng: np.random.Generator) -> None:
        given = self._parameters
        self._driver = NetworkDriver(
            self._checkpoint, given.cruise_speed, nanoseconds(given.maximum_age)
        )
        self._brake = BrakeHold(nanoseconds(given.brake_hold))

    @override
    def drive(self, inputs: Inputs, now: Time) -> Command:
        accelerate, brake, steer = self._driver.command(inputs, now).tolist()
        command = Command(accelerate=accelerate, brake=brake, steer=steer)
        return self._brake.held(command, now)
