"""What the iterative algorithms have in common: who repeats steps, and until when."""

import abc
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from typing_extensions import override

from orchestrator.algorithm.acceleration import Acceleration
from orchestrator.algorithm.age import Age, ages_by_turn
from orchestrator.algorithm.base import CosimulationAlgorithm, Stepping
from orchestrator.algorithm.exchange import Due, Exchange, Turn
from orchestrator.algorithm.extrapolation import DEGREES, Extrapolation
from orchestrator.algorithm.iteration import Disagreement, Tolerance, predict, repeat
from orchestrator.component import DecidingComponent, RestorableComponent
from orchestrator.errors import ComponentError, SystemStructureError
from orchestrator.feedthrough import dependent_groups
from orchestrator.parameters import parameter
from orchestrator.system import System
from orchestrator.timebase import Time


@dataclass(frozen=True, slots=True, kw_only=True)
class IterativeAlgorithm(CosimulationAlgorithm):
    """Components that depend on each other step again and again, until their outputs agree.

    The others take turns as with Gauss-Seidel, in an order without delay. Those of a cycle step
    over the same interval, see the newest outputs of each other, return to the state before the
    step, and repeat that until no output changes by more than the tolerance. What is published is
    what the last repetition gave. So a connection within a cycle has no delay either, and an
    algebraic loop is solved at every communication point.
    """

    iterate: Literal["cycles", "algebraic-loops"] = parameter(
        "cycles",
        doc="what is repeated: every cycle of connections, or only the components of algebraic "
        "loops; other connections against the order are then delayed, as with Gauss-Seidel",
    )
    interpolation: Extrapolation = parameter(
        "hold",
        doc="how continuous real inputs run over a step: held at their value at its end, or as "
        "polynomials through that and the one or two before",
    )
    relative_tolerance: float = parameter(
        1e-9, minimum=0, maximum=1, doc="change of an output relative to its value that is accepted"
    )
    absolute_tolerance: float = parameter(
        1e-9, minimum=0, doc="change of an output, in its own unit, that is accepted in addition"
    )
    maximum_iterations: int = parameter(
        100, minimum=2, doc="steps of one component for one communication point; more is an error"
    )

    @abc.abstractmethod
    def acceleration(self) -> Acceleration:
        """How the next repetition is made of those before, new for each solution."""

    @abc.abstractmethod
    def advice(self) -> str:
        """What to try where components do not agree."""

    @property
    def degree(self) -> int:
        """The degree of the polynomials as which real inputs run over a step; 0: they are held."""
        return DEGREES[self.interpolation]

    @override
    def turns(self, system: System) -> tuple[str, ...]:
        problems = [
            f"`{name}` depends on itself through {path(names, name)}, so {self._noun()} "
            f"has to repeat its steps, but {reason}; {self._way_out()}"
            for names in self.solved(system)
            for name in in_order(system, names)
            if (reason := reason_against_repeating(system, name)) is not None
        ]
        if problems:
            raise SystemStructureError(problems)
        return tuple(name for group in self._groups(system) for name in group)

    @override
    def solved(self, system: System) -> tuple[frozenset[str], ...]:
        return cycles(system, self._groups(system))

    @override
    def ages(self, system: System) -> Mapping[tuple[str, str], Age]:
        return ages_by_turn(system, self.turns(system), self.solved(system))

    @override
    def of_run(self, system: System, exchange: Exchange) -> Stepping:
        exchange.approximate(system, self.degree)
        return self

    @override
    def arrive(self, t: Time, due: Due) -> None:
        for turn in due.turns:
            if turn.is_solved:
                self._solve(t, turn)
            else:
                for wave in turn.waves:
                    wave.step_to(t)

    def _groups(self, system: System) -> tuple[tuple[str, ...], ...]:
        return dependent_groups(system, by_feedthrough=self.iterate == "algebraic-loops")

    @abc.abstractmethod
    def _noun(self) -> str:
        """What the iteration is called in a sentence."""

    def _way_out(self) -> str:
        others = "give one of the connections a delay by `algorithm: gauss-seidel` with an `order`"
        if self.iterate == "cycles":
            return f"repeat algebraic loops only (`iterate: algebraic-loops`), or {others}"
        return others

    def _solve(self, t: Time, turn: Turn) -> None:
        """Step the participants of `turn` to `t` until they agree."""
        saved = [(each, each.save(each.before(t))) for each in turn.participants]
        if self.degree > 0:
            for each in turn.participants:
                predict(each, t, self.degree)

        def sweep() -> None:
            for wave in turn.waves:
                wave.step_to(t)

        def again() -> None:
            for each, state in saved:
                each.restore(state, each.before(t))

        found = repeat(
            turn.participants,
            sweep,
            again,
            tolerance=Tolerance(relative=self.relative_tolerance, absolute=self.absolute_tolerance),
            maximum=self.maximum_iterations,
            acceleration=self.acceleration(),
        )
        if found is not None:
            raise self._failure(t, turn, found)

    def _failure(self, t: Time, turn: Turn, found: Disagreement) -> ComponentError:
        culprit = found.participant
        return ComponentError(
            culprit.name,
            culprit.before(t),
            f"does not agree with {_others(turn, culprit.name)}: after {self.maximum_iterations} "
            f"iterations `{found.output}` still changes by {_spell(found.change)} the tolerance; "
            f"{self.advice()}",
        )


def cycles(system: System, groups: tuple[tuple[str, ...], ...]) -> tuple[frozenset[str], ...]:
    """Those of the groups whose members depend on each other, or on themselves."""
    loops = {
        (link.source.component, link.target.component)
        for link in system.connections
        if not link.way.delay
    }
    return tuple(frozenset(g) for g in groups if len(g) > 1 or (g[0], g[0]) in loops)


def in_order(system: System, names: frozenset[str]) -> list[str]:
    """The names in the order of the system."""
    return [name for name in system.components if name in names]


def path(names: frozenset[str], name: str) -> str:
    """The components through which one of a cycle depends on itself."""
    others = ", ".join(f"`{other}`" for other in sorted(names - {name}))
    return others or "a connection of its own"


def reason_against_repeating(system: System, name: str) -> str | None:
    """Why the steps of a component cannot be repeated; `None` if they can."""
    component = system.components[name]
    if isinstance(component, DecidingComponent):
        return "a component that tries its alternatives cannot be taken back"
    if not isinstance(component, RestorableComponent):
        return "it cannot return to an earlier state"
    return None


def _spell(change: float) -> str:
    return "more than" if change == float("inf") else f"{change:.3g} times"


def _others(turn: Turn, name: str) -> str:
    names = [f"`{each.name}`" for each in turn.participants if each.name != name]
    return ", ".join(names) if names else "itself"
