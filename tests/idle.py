"""Components that do nothing in a step."""

import abc

import numpy as np
from typing_extensions import override

from orchestrator.component import Component
from orchestrator.signal import Signals
from orchestrator.timebase import Duration, Time


class Idle(Component, abc.ABC):
    """Has no state; what it puts out is up to the class that is derived from it."""

    @override
    def setup(self, start: Time, rng: np.random.Generator) -> None:
        pass

    @override
    def step(self, inputs: Signals, t: Time, h: Duration) -> None:
        pass
