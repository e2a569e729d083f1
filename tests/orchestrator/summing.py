"""Components whose output is a sum, `sum`: how they step, and what is seen of them."""

from collections.abc import Mapping

import numpy as np
from typing_extensions import override

from orchestrator.component import Component, WrappedComponent
from orchestrator.observer import Observer, SimulationResult
from orchestrator.signal import Signals
from orchestrator.system import System
from orchestrator.timebase import Duration, Time


class InOnePiece(WrappedComponent):
    """One that cannot step beside others."""

    @override
    def step(self, inputs: Signals, t: Time, h: Duration) -> None:
        self._wrapped.step(inputs, t, h)


def in_two_pieces(component: Component) -> Component:
    """One that steps beside others, as it is."""
    return component


class Trace(Observer):
    """What was published when, by whom."""

    def __init__(self) -> None:
        self.seen: list[tuple[Time, tuple[str, ...], dict[str, int]]] = []

    @override
    def begin(self, system: System, start: Time, stop: Time) -> None:
        pass

    @override
    def observe(self, t: Time, published: tuple[str, ...], values: Mapping[str, Signals]) -> None:
        sums = {name: int(np.asarray(signals["sum"])) for name, signals in values.items()}
        self.seen.append((t, published, sums))

    @override
    def end(self, result: SimulationResult) -> None:
        pass
