"""A component for tests of experiments, which run in processes of their own."""

import os
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from typing_extensions import override

from orchestrator.component import Component
from orchestrator.parameters import parameter
from orchestrator.signal import Connector, Signals
from orchestrator.timebase import Duration, Time


class Mortal(Component):
    """May take its process with it, as a fault in native code does."""

    @dataclass(frozen=True, slots=True, kw_only=True)
    class Parameters:
        dies: bool = parameter(False, doc="whether the process ends in the first step")

    def __init__(self, parameters: Parameters) -> None:
        self._parameters = parameters

    @property
    @override
    def connectors(self) -> Mapping[str, Connector]:
        return {}

    @override
    def setup(self, start: Time, rng: np.random.Generator) -> None:
        pass

    @override
    def step(self, inputs: Signals, t: Time, h: Duration) -> None:
        if self._parameters.dies:
            os._exit(1)

    @override
    def outputs(self) -> Signals:
        return {}
