"""The Jacobi (parallel) algorithm."""

from collections.abc import Mapping
from dataclasses import dataclass

from typing_extensions import override

from orchestrator.algorithm.age import Age, connected
from orchestrator.algorithm.base import Pattern
from orchestrator.algorithm.exchange import Due
from orchestrator.algorithm.extrapolation import ExtrapolatingAlgorithm
from orchestrator.component import ConcurrentComponent
from orchestrator.system import System
from orchestrator.timebase import Time


@dataclass(frozen=True, slots=True)
class Jacobi(ExtrapolatingAlgorithm):
    """All step at once; every step sees the outputs of the communication point where it starts.

    A component that steps from `t` to `t + H` reads its inputs at `t`; its outputs are published
    at `t + H`, not before. The result does not depend on the order of the components.
    Concurrent components are begun first and waited for where their step ends, so that they
    run beside the local ones, also beside several shorter steps of them.
    """

    @property
    @override
    def pattern(self) -> Pattern | None:
        return Pattern.PARALLEL if self.is_held else None

    @override
    def turns(self, system: System) -> tuple[str, ...]:
        concurrent = [
            name
            for name, component in system.components.items()
            if isinstance(component, ConcurrentComponent)
        ]
        return (*concurrent, *(name for name in system.components if name not in concurrent))

    @override
    def ages(self, system: System) -> Mapping[tuple[str, str], Age]:
        sizes = system.step_sizes
        return {(a, b): Age.held(sizes[a], sizes[b]) for a, b in connected(system)}

    @override
    def depart(self, t: Time, due: Due) -> None:
        for participant in due.participants:
            participant.begin(t)

    @override
    def arrive(self, t: Time, due: Due) -> None:
        for participant in due.participants:
            participant.finish()
        for participant in due.participants:
            participant.publish()
