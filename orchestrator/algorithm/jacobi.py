"""The Jacobi (parallel) algorithm."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from typing_extensions import override

from orchestrator.algorithm.age import Age, connected
from orchestrator.algorithm.base import Pattern, Stepping
from orchestrator.algorithm.exchange import Due, Exchange
from orchestrator.algorithm.extrapolation import ExtrapolatingAlgorithm
from orchestrator.algorithm.participant import Participant
from orchestrator.component import ConcurrentComponent
from orchestrator.feedthrough import feedthrough_order, has_feedthrough
from orchestrator.system import System
from orchestrator.timebase import StepSize, Time


@dataclass(frozen=True, slots=True)
class Jacobi(ExtrapolatingAlgorithm):
    """All step at once; every step sees the outputs of the communication point where it starts.

    A component that steps from `t` to `t + H` reads its inputs at `t`; its outputs are published
    at `t + H`, not before. The result does not depend on the order of the components.
    Concurrent components are begun first and waited for where their step ends, so that they
    run beside the local ones, also beside several shorter steps of them.

    Outputs with direct feedthrough are those of the inputs at the end of a step, where components
    can say what they are (`PointEvaluation`): they are computed anew when all have stepped.
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
    def _held_lag(self, step: StepSize) -> StepSize:
        return step

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

    @override
    def of_run(self, system: System, exchange: Exchange) -> Stepping:
        # not `super()`, which dataclasses with slots break
        ExtrapolatingAlgorithm.of_run(self, system, exchange)
        return _Renewing(self, renewed) if (renewed := _renewed(system, exchange)) else self


class _Renewing(Stepping):
    """Lets outputs with direct feedthrough follow at the end of steps.

    Args:
        algorithm: makes the steps.
        renewed: those whose outputs follow, in the order of direct feedthrough.
    """

    def __init__(self, algorithm: Jacobi, renewed: Sequence[Participant]) -> None:
        self._algorithm = algorithm
        self._renewed = tuple(renewed)

    @override
    def depart(self, t: Time, due: Due) -> None:
        self._algorithm.depart(t, due)

    @override
    def memory(self) -> Any | None:
        return {}

    @override
    def arrive(self, t: Time, due: Due) -> None:
        self._algorithm.arrive(t, due)
        for participant in self._renewed:
            if participant.name in due.names:
                participant.refresh(t)


def _renewed(system: System, exchange: Exchange) -> list[Participant]:
    return [
        exchange.participants[name]
        for name in feedthrough_order(system)
        if is_renewed(system, exchange, name)
    ]


def is_renewed(system: System, exchange: Exchange, name: str) -> bool:
    """Whether the outputs of a component follow its inputs at the end of steps."""
    return exchange.participants[name].can_refresh and has_feedthrough(system, name)
