"""A component for tests of experiments, which run in processes of their own."""

import os
from dataclasses import dataclass

from typing_extensions import override

from orchestrator.parameters import parameter
from orchestrator.signal import Signals
from orchestrator.timebase import Duration, Time
from tests.orchestrator.packages.sample_units import Isolated


class Mortal(Isolated):
    """May take its process with it, as a fault in native code does."""

    @dataclass(frozen=True, slots=True, kw_only=True)
    class Parameters:
        dies: bool = parameter(False, doc="whether the process ends in the first step")

    def __init__(self, parameters: Parameters) -> None:
        self._parameters = parameters

    @override
    def step(self, inputs: Signals, t: Time, h: Duration) -> None:
        if self._parameters.dies:
            os._exit(1)
