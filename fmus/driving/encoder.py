"""The computer of those who share their perception: each scan becomes a message of features."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final, Self, TypeAlias

import numpy as np
from typing_extensions import override

from fmus.driving.network.checkpoint import read_network, shipped_or_none
from fmus.driving.network.cloud import clouds
from fmus.driving.network.sensors import Sender
from fmus.messages.connectors import SIGNALS, inputs, when_undriven
from fmus.messages.features import write_features
from orchestrator.absence import Need, Undriven
from orchestrator.component import Component
from orchestrator.parameters import parameter
from orchestrator.signal import Causality, Connector, Signals
from orchestrator.timebase import Duration, Time

INPUTS: Final[Mapping[str, Connector]] = when_undriven(
    inputs("points", "ego.id"),
    {
        "points": Undriven("there are no scans, and nobody sends features"),
        "ego.id": Undriven("there is no ego: every lidar's features are sent", Need.IF_OFFERED),
    },
)
CONNECTORS: Final[Mapping[str, Connector]] = {
    **INPUTS,
    "features": replace(
        SIGNALS["features"],
        causality=Causality.OUTPUT,
        feedthrough=frozenset(INPUTS),
        description="Keypoints of the last scan of every lidar but the ego's, by vehicle",
    ),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Inputs:
    """What an encoder reads.

    Attributes:
        ego: number of the ego vehicle, -1 if there is none.
        points: scans of all lidars, an "LPTS" Binary signal.
    """

    ego: int
    points: bytes

    @classmethod
    def read(cls, signals: Signals) -> Self:
        """The view of the inputs of an encoder."""
        return cls(
            ego=int(np.asarray(signals["ego.id"], np.int64)), points=bytes(signals["points"])
        )


class FeatureEncoder(Component):
    """Turns the scans of every lidar but the ego's into messages of keypoints with features.

    Each vehicle computes from its own scans alone; the features go on the air by `facilities`.
    The policy that reads them must be given the same `network`.
    """

    connectors = CONNECTORS

    @dataclass(frozen=True, slots=True, kw_only=True)
    class _Parameters:
        """Parameters of the encoder."""

        network: str | Path = parameter(
            "bev-32",
            doc="a network that comes with the package, or the path of a checkpoint; "
            "empty: nothing is sent",
            names=shipped_or_none,
        )

    Parameters: TypeAlias = _Parameters

    def __init__(self, parameters: _Parameters) -> None:
        self._checkpoint = read_network(parameters.network) if parameters.network else None

    @override
    def setup(self, start: Time, rng: np.random.Generator) -> None:
        self._senders: dict[int, Sender] = {}
        self._read = Inputs(ego=-1, points=b"")
        self._outputs: Signals = {"features": b""}

    @override
    def step(self, inputs: Signals, t: Time, h: Duration) -> None:
        if self._checkpoint is None:
            return
        read = Inputs.read(inputs)
        if read == self._read:
            return
        self._read = read
        found = [cloud for cloud in clouds(read.points) if cloud.vehicle != read.ego]
        self._senders = {
            cloud.vehicle: self._senders.get(cloud.vehicle) or Sender(self._checkpoint)
            for cloud in found
        }
        messages = [self._senders[cloud.vehicle].message(cloud) for cloud in found]
        self._outputs = {"features": write_features(messages) if messages else b""}

    @override
    def outputs(self) -> Signals:
        return self._outputs
