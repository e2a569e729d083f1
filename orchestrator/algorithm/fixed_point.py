"""Fixed-point iteration: components that depend on each other step until they agree."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final, Literal, TypeAlias

import numpy as np
from typing_extensions import override

from orchestrator.algorithm.age import Age, ages_by_turn
from orchestrator.algorithm.base import CosimulationAlgorithm
from orchestrator.algorithm.exchange import Due, Turn
from orchestrator.component import DecidingComponent, RestorableComponent
from orchestrator.errors import ComponentError, SystemStructureError
from orchestrator.feedthrough import dependent_groups
from orchestrator.parameters import parameter
from orchestrator.signal import Signal
from orchestrator.system import System
from orchestrator.timebase import Time

Published: TypeAlias = list[dict[str, Signal]]
"""The outputs of each participant of a turn, as others saw them at one moment."""

_AGREED: Final = 1.0
"""The largest change within the tolerance."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FixedPoint(CosimulationAlgorithm):
    """Components that depend on each other step again and again, until their outputs agree.

    The others take turns as with Gauss-Seidel, in an order without delay. Those of a cycle step
    over the same interval, see the newest outputs of each other, return to the state before the
    step, and repeat that until no output changes by more than the tolerance (Kuebler and Schiehlen,
    "Two methods of simulator coupling", Math. Comput. Model. Dyn. Syst. 6(2), 2000). What
    is published is what the last repetition gave. So a connection within a cycle has no delay
    either, and an algebraic loop is solved at every communication point but the first.

    The iteration converges where the loop contracts: the error shrinks by the loop gain each time.
    Inputs are held over a step at their value at its end, so the error of coupling is of first
    order in the step size, as it is with the other algorithms.
    """

    iterate: Literal["cycles", "algebraic-loops"] = parameter(
        "cycles",
        doc="what is repeated: every cycle of connections, or only the components of algebraic "
        "loops; other connections against the order are then delayed, as with Gauss-Seidel",
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
    relaxation: float = parameter(
        1.0,
        minimum=0.01,
        maximum=1,
        doc="share of each change that the next repetition sees; below 1 where the loop gain is "
        "below -1",
    )

    @override
    def turns(self, system: System) -> tuple[str, ...]:
        problems = [
            f"`{name}` depends on itself through {_path(names, name)}, so fixed-point iteration "
            f"has to repeat its steps, but {reason}; {self._advice()}"
            for names in self.solved(system)
            for name in _in_order(system, names)
            if (reason := _reason(system, name)) is not None
        ]
        if problems:
            raise SystemStructureError(problems)
        return tuple(name for group in self._groups(system) for name in group)

    @override
    def solved(self, system: System) -> tuple[frozenset[str], ...]:
        loops = {
            (link.source.component, link.target.component)
            for link in system.connections
            if not link.way.delay
        }
        groups = self._groups(system)
        return tuple(frozenset(g) for g in groups if len(g) > 1 or (g[0], g[0]) in loops)

    @override
    def ages(self, system: System) -> Mapping[tuple[str, str], Age]:
        return ages_by_turn(system, self.turns(system), self.solved(system))

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

    def _advice(self) -> str:
        others = "give one of the connections a delay by `algorithm: gauss-seidel` with an `order`"
        if self.iterate == "cycles":
            return f"repeat algebraic loops only (`iterate: algebraic-loops`), or {others}"
        return others

    def _solve(self, t: Time, turn: Turn) -> None:
        """Step the participants of `turn` to `t` until they agree."""
        saved = [(each, each.save(t - each.step_size)) for each in turn.participants]
        before = _published(turn)
        for iteration in range(1, self.maximum_iterations + 1):
            for wave in turn.waves:
                wave.step_to(t)
            after = _published(turn)
            change, name, output = self._largest_change(turn, before, after)
            if change <= _AGREED:
                return
            if iteration < self.maximum_iterations:
                self._relax(turn, before, after)
                before = _published(turn)
                for each, state in saved:
                    each.restore(state, t - each.step_size)
        culprit = next(each for each in turn.participants if each.name == name)
        raise ComponentError(
            name,
            t - culprit.step_size,
            f"does not agree with {_others(turn, name)}: after {self.maximum_iterations} "
            f"iterations `{output}` still changes by {_spell(change)} the tolerance; the loop "
            "may not contract: try a smaller step, `relaxation` below 1, or more "
            "`maximum_iterations`",
        )

    def _largest_change(
        self, turn: Turn, before: Published, after: Published
    ) -> tuple[float, str, str]:
        """The largest change in units of the tolerance, whose it is, and of which output."""
        changes = (
            (self._change(old[output], value), each.name, output)
            for each, old, new in zip(turn.participants, before, after, strict=True)
            for output, value in new.items()
            if value is not old[output]
        )
        return max(changes, key=lambda change: change[0], default=(0.0, "", ""))

    def _change(self, old: Signal, new: Signal) -> float:
        """How far `new` is from `old`, in tolerances; 0 or infinite for what is no float."""
        if not (_is_real(old) and _is_real(new)) or np.shape(old) != np.shape(new):
            return 0.0 if _is_equal(old, new) else math.inf
        a, b = np.asarray(old), np.asarray(new)
        allowed = self.absolute_tolerance + self.relative_tolerance * np.abs(b)
        with np.errstate(divide="ignore", invalid="ignore"):
            ratio = np.abs(b - a) / allowed
        return float(np.max(np.where(a == b, 0.0, ratio), initial=0.0))

    def _relax(self, turn: Turn, before: Published, after: Published) -> None:
        """Let others see only a share of the change."""
        if self.relaxation == 1.0:
            return
        for each, old, new in zip(turn.participants, before, after, strict=True):
            each.show(
                {
                    output: self._between(old[output], value)
                    for output, value in new.items()
                    if _is_real(value) and np.shape(old[output]) == np.shape(value)
                }
            )

    def _between(self, old: Signal, new: Signal) -> Signal:
        a, b = np.asarray(old), np.asarray(new)
        value = np.asarray(a + self.relaxation * (b - a), dtype=b.dtype)
        value.setflags(write=False)
        return value


def _published(turn: Turn) -> Published:
    return [dict(each.published) for each in turn.participants]


def _is_real(value: Signal) -> bool:
    return isinstance(value, np.ndarray) and value.dtype.kind == "f"


def _is_equal(old: Signal, new: Signal) -> bool:
    if isinstance(old, bytes) or isinstance(new, bytes):
        return old == new
    return np.array_equal(old, new)


def _spell(change: float) -> str:
    return "more than" if math.isinf(change) else f"{change:.3g} times"


def _others(turn: Turn, name: str) -> str:
    names = [f"`{each.name}`" for each in turn.participants if each.name != name]
    return ", ".join(names) if names else "itself"


def _in_order(system: System, names: frozenset[str]) -> list[str]:
    return [name for name in system.components if name in names]


def _path(names: frozenset[str], name: str) -> str:
    others = ", ".join(f"`{other}`" for other in sorted(names - {name}))
    return others or "a connection of its own"


def _reason(system: System, name: str) -> str | None:
    """Why the steps of a component cannot be repeated; `None` if they can."""
    component = system.components[name]
    if isinstance(component, DecidingComponent):
        return "a component that tries its alternatives cannot be taken back"
    if not isinstance(component, RestorableComponent):
        return "it cannot return to an earlier state"
    return None
