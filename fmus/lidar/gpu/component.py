"""The component: its life cycle, and its seed."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from typing_extensions import override

from fmus.lidar.gpu.connectors import CONNECTORS
from fmus.lidar.gpu.inputs import Inputs
from fmus.lidar.gpu.parameters import LidarParameters, check_parameters
from orchestrator.component import RestorableComponent
from orchestrator.signal import Connector, Signals
from orchestrator.timebase import Duration, Time

if TYPE_CHECKING:
    from fmus.lidar.gpu.scanner import Scanner


class LidarTorch(RestorableComponent[Signals]):
    """The sensors of `lidar` computed with PyTorch, on the CPU or (`device: cuda`) on a GPU.

    docs/physics-lidar.md describes the model, which is that of the FMU `lidar`: the same rays
    hit the same instances, at distances that agree to rounding. PyTorch is imported by
    `setup`, and computes with one thread in this process from then on.

    Raises:
        ComponentTypeError: parameters are wrong, PyTorch is not installed, or finds no GPU where
            `device` is cuda.
    """

    Parameters = LidarParameters

    def __init__(self, parameters: LidarParameters) -> None:
        check_parameters(parameters)
        self._parameters = parameters
        self._scanner: Scanner | None = None
        self._outputs: Signals = {}
        self._start: Time = 0

    @property
    @override
    def connectors(self) -> Mapping[str, Connector]:
        return CONNECTORS

    @override
    def setup(self, start: Time, rng: np.random.Generator) -> None:
        from fmus.lidar.gpu.scanner import Scanner  # noqa: PLC0415 - imports PyTorch

        self._start = start
        self._scanner = Scanner(self._parameters, self._seed(rng))
        self._outputs = {"points": b""}

    def _seed(self, rng: np.random.Generator) -> int:
        """The seed of the scenario, or one drawn as for the FMU, so that both have equal noise."""
        given: object = self._parameters.seed
        drawn = int(rng.integers(0, np.iinfo(np.int32).max, endpoint=True))
        return given if isinstance(given, int) else drawn

    @override
    def initialise(self, inputs: Signals) -> None:
        self._scan(Inputs.read(inputs), self._start)

    @override
    def step(self, inputs: Signals, t: Time, h: Duration) -> None:
        self._scan(Inputs.read(inputs), t + h)

    def _scan(self, inputs: Inputs, time: Time) -> None:
        if self._scanner is None:
            raise RuntimeError("the lidar is not running: `setup` comes first")
        self._outputs = {"points": self._scanner.scan(inputs, time)}

    @override
    def outputs(self) -> Signals:
        return self._outputs

    @override
    def save(self) -> Signals:
        return self._outputs

    @override
    def restore(self, state: Signals) -> None:
        self._outputs = state

    @override
    def close(self) -> None:
        self._scanner = None
