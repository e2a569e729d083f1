"""The Gauss-Seidel (sequential) algorithm."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from typing_extensions import override

from orchestrator.algorithm.age import Age, ages_by_turn
from orchestrator.algorithm.base import Pattern, Stepping
from orchestrator.algorithm.exchange import Due, Exchange
from orchestrator.algorithm.extrapolation import ExtrapolatingAlgorithm
from orchestrator.errors import SystemStructureError
from orchestrator.feedthrough import describe, feedthrough_order, loops
from orchestrator.parameters import ParameterProblem, parameter
from orchestrator.suggestion import suggestion
from orchestrator.system import System
from orchestrator.timebase import StepSize, Time


@dataclass(frozen=True, slots=True)
class GaussSeidel(ExtrapolatingAlgorithm):
    """Components take turns; each sees the newest outputs of those before it.

    A component whose step ends at `t` steps when `t` is reached, over `t - H` to `t`. It sees
    the outputs at `t` of the components before it in the order, and of those behind it what they
    published before `t`. Its own outputs are published at once, so that a chain of direct
    feedthrough in this order has no delay.
    """

    order: tuple[str, ...] | None = parameter(
        None,
        doc="the names of all components, first to step first; without, the order of direct "
        "feedthrough, which exists unless there is an algebraic loop",
    )

    @override
    def problems(self, components: Sequence[str]) -> Iterator[ParameterProblem]:
        order = components if self.order is None else self.order
        for index, name in enumerate(order):
            if name not in components:
                what = f"there is no component `{name}`; {suggestion(name, components)}"
                yield ParameterProblem(("order", index), what)
            elif name in order[:index]:
                yield ParameterProblem(("order", index), f"`{name}` is named twice")
        absent = [f"`{name}`" for name in components if name not in order]
        if absent:
            what = f"{', '.join(absent)} missing; name every component, or leave `order` out"
            yield ParameterProblem(("order",), what, at_key=True)

    @property
    @override
    def pattern(self) -> Pattern | None:
        return Pattern.SEQUENTIAL if self.is_held else None

    @override
    def turns(self, system: System) -> tuple[str, ...]:
        if self.order is None:
            found = loops(system)
            if found:
                raise SystemStructureError([describe(loop) for loop in found])
            return feedthrough_order(system)
        problems = list(self.problems(tuple(system.components)))
        if problems:
            raise SystemStructureError([f"the order of Gauss-Seidel: {p.what}" for p in problems])
        return self.order

    @override
    def ages(self, system: System) -> Mapping[tuple[str, str], Age]:
        return ages_by_turn(system, self.turns(system))

    @override
    def _held_lag(self, step: StepSize) -> StepSize:
        return 0  # inputs are read where the step ends

    @override
    def of_run(self, system: System, exchange: Exchange) -> Stepping:
        # not `super()`, which dataclasses with slots break
        ExtrapolatingAlgorithm.of_run(self, system, exchange)
        exchange.take_turns(self.turns(system))
        return self

    @override
    def look_ahead(self, t: Time, due: Due) -> None:
        for participant in due.participants:
            participant.begin_ahead(t)
        # in this order, so that what one has made is there for those that read it
        for participant in due.elsewhere:
            participant.foresee(t)

    @override
    def arrive(self, t: Time, due: Due) -> None:
        # a wave at a time gives the same values as one at a time, and lets concurrent
        # components work side by side
        for wave in due.waves:
            wave.step_to(t)

    @override
    def pass_by(self, t: Time, due: Due) -> None:
        for wave in due.waves:
            wave.step_to(t, goes_on=True)
