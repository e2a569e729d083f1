"""Adaptive steps: components that depend on each other step as finely as their signals need."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from typing_extensions import override

from orchestrator.algorithm.age import Age, ages_by_turn
from orchestrator.algorithm.base import CosimulationAlgorithm, Stepping
from orchestrator.algorithm.exchange import Due, Exchange
from orchestrator.algorithm.extrapolation import DEGREES, Extrapolation
from orchestrator.algorithm.history import approximated
from orchestrator.algorithm.iteration import Tolerance
from orchestrator.algorithm.iterative import cycles, in_order, path, reason_against_repeating
from orchestrator.algorithm.participant import Participant
from orchestrator.algorithm.requests import EndedWithinStep
from orchestrator.algorithm.step_control import StepControl
from orchestrator.capabilities import VariableSteps
from orchestrator.errors import SystemStructureError
from orchestrator.feedthrough import dependent_groups
from orchestrator.parameters import parameter
from orchestrator.signal import Array, Variability
from orchestrator.system import System
from orchestrator.timebase import Duration, StepSize, Time, format_duration


@dataclass(frozen=True, slots=True, kw_only=True)
class Adaptive(CosimulationAlgorithm):
    """Components that depend on each other make as many steps as the tolerance asks for.

    Communication points stay as they are. Between two of them those of a cycle take turns with
    steps of a length of their own: inputs run on as polynomials, and where an output then differs
    from what its readers went by, by more than the tolerance, all return to the state before the
    step and make a shorter one. The difference is the error that the coupling makes, of order
    `degree` + 1 in the step, as is the error of the result (compare Schierz, Arnold and Clauss,
    "Co-simulation with communication step size control in an FMI compatible master algorithm",
    Modelica conference 2012, who estimate it by Richardson extrapolation, at three times the
    steps). All other components take turns as with Gauss-Seidel, in an order without delay.
    """

    relative_tolerance: float = parameter(
        1e-3,
        minimum=0,
        maximum=1,
        doc="by how much an output may differ from what its readers went by, relative to its "
        "largest absolute value so far",
    )
    absolute_tolerance: float = parameter(
        1e-6, minimum=0, doc="the same in the unit of the output, in addition"
    )
    extrapolation: Extrapolation = parameter(
        "linear",
        doc="how continuous real inputs run over a step: held, or as polynomials through the last "
        "two or three values",
    )
    maximum_steps: int = parameter(
        1000,
        minimum=1,
        maximum=1_000_000,
        doc="the smallest step is this part of the communication step; it counts whatever its "
        "error, as where a signal jumps",
    )

    @property
    def degree(self) -> int:
        """The degree of the polynomials as which real inputs run over a step; 0: they are held."""
        return DEGREES[self.extrapolation]

    @override
    def turns(self, system: System) -> tuple[str, ...]:
        groups = dependent_groups(system, by_feedthrough=False)
        problems = [what for names in cycles(system, groups) for what in _problems(system, names)]
        if problems:
            raise SystemStructureError(problems)
        return tuple(name for group in groups for name in group)

    @override
    def ages(self, system: System) -> Mapping[tuple[str, str], Age]:
        found = dict(ages_by_turn(system, self.turns(system)))
        for names in _cycles(system):
            longest = system.step_sizes[min(names)]
            inner = Age(youngest=self._smallest(longest), oldest=longest)
            found |= {
                pair: inner for pair, age in found.items() if set(pair) <= names and age.youngest
            }
        return found

    @override
    def of_run(self, system: System, exchange: Exchange) -> Stepping:
        exchange.approximate(system, self.degree)
        tolerance = Tolerance(relative=self.relative_tolerance, absolute=self.absolute_tolerance)
        turns = self.turns(system)
        groups = []
        for names in _cycles(system):
            longest = system.step_sizes[min(names)]
            members = tuple(exchange.participants[name] for name in turns if name in names)
            watched = tuple(_watched(system, exchange, names, self.degree))
            control = StepControl(math.ceil(longest), self._smallest(longest), self.degree + 1)
            groups.append(_Group(members, watched, tolerance, control))
        return _Adapting(groups)

    def _smallest(self, longest: StepSize) -> Duration:
        return max(1, int(longest) // self.maximum_steps)

    @override
    def arrive(self, t: Time, due: Due) -> None:
        raise RuntimeError("`of_run` makes what is called")


class _Watched:
    """An output that readers of its own group go by.

    Args:
        participant: whose it is.
        output: its name.
        degree: of the polynomial that the readers follow.

    Attributes:
        largest: its largest absolute value so far.
    """

    def __init__(self, participant: Participant, output: str, degree: int) -> None:
        self._participant, self._output, self._degree = participant, output, degree
        self.largest = 0.0

    def _value(self) -> Array:
        return np.asarray(self._participant.published[self._output])

    def expected(self, t: Time, h: Duration) -> Array:
        """What the readers take it to be at the end of the step from `t` to `t + h` [ns]."""
        if self._degree == 0:
            return self._value()
        history = self._participant.remember()
        return history.course(self._output, t, h, self._degree).at(1.0)

    def error(self, expected: Array, tolerance: Tolerance) -> float:
        """How far it is from what was expected, in tolerances."""
        value = self._value()
        if value.shape != expected.shape:
            return math.inf
        scale = max(self.largest, float(np.max(np.abs(value), initial=0.0)))
        allowed = float(tolerance.allowed(np.asarray(scale)))
        difference = float(np.max(np.abs(value - expected), initial=0.0))
        if difference == 0.0:
            return 0.0
        return difference / allowed if allowed > 0.0 else math.inf

    def keep(self) -> None:
        """Remember how large it is: the step counts."""
        self.largest = max(self.largest, float(np.max(np.abs(self._value()), initial=0.0)))


@dataclass(frozen=True, slots=True)
class _Group:
    """Components that depend on each other.

    Attributes:
        participants: in the order of their turns.
        watched: outputs whose course decides how long a step is.
        tolerance: of each of them.
        control: of the steps.
    """

    participants: tuple[Participant, ...]
    watched: tuple[_Watched, ...]
    tolerance: Tolerance
    control: StepControl

    def step_to(self, end: Time) -> None:
        """Make the communication step that ends at `end`, in as many steps as it takes."""
        now = self.participants[0].before(end)
        while now < end:
            h = self.control.next(end - now)
            saved = _Saved(self.participants, now) if self.control.may_reject(h) else None
            expected = [each.expected(now, h) for each in self.watched]
            for participant in self.participants:
                participant.begin(now, h)
                participant.finish()
                participant.publish()
            pairs = zip(self.watched, expected, strict=True)
            error = max((each.error(old, self.tolerance) for each, old in pairs), default=0.0)
            if self.control.judge(h, error) or saved is None:
                now += h
                for each in self.watched:
                    each.keep()
                self._heed(is_within=now < end)
            else:
                saved.restore()

    def _heed(self, *, is_within: bool) -> None:
        """Go on, unless somebody asks for the end of the run within the communication step."""
        for each in self.participants:
            if is_within and each.asking.request is not None:
                raise EndedWithinStep(each.name, each.asking.request)


class _Saved:
    """Where participants were at one time, and what others saw of them.

    Args:
        participants: of one group.
        t: the time [ns].
    """

    def __init__(self, participants: Sequence[Participant], t: Time) -> None:
        self._t = t
        self._states = [(each, each.save(t), dict(each.published)) for each in participants]

    def restore(self) -> None:
        """Return to it."""
        for each, state, published in self._states:
            each.restore(state, self._t)
            each.published.update(published)
            each.remember().forget_from(self._t + 1)


class _Adapting(Stepping):
    """Lets groups make steps of their own.

    Args:
        groups: disjoint.
    """

    def __init__(self, groups: Sequence[_Group]) -> None:
        self._groups: Final = tuple(groups)
        self._led = {group.participants[0].name: group for group in groups}
        self._members = frozenset(each.name for group in groups for each in group.participants)

    @override
    def depart(self, t: Time, due: Due) -> None:
        for each in due.participants:
            each.begin_ahead(t)

    @override
    def arrive(self, t: Time, due: Due) -> None:
        for each in due.participants:
            if each.name in self._led:
                self._led[each.name].step_to(t)
            elif each.name not in self._members:
                if not each.is_begun:
                    each.begin(each.before(t))
                each.finish()
                each.publish()

    @override
    def memory(self) -> Any | None:
        return [[g.control.memory(), [each.largest for each in g.watched]] for g in self._groups]

    @override
    def recall(self, memory: Any) -> None:
        for group, (control, largest) in zip(self._groups, memory, strict=True):
            group.control.recall(control)
            for each, value in zip(group.watched, largest, strict=True):
                each.largest = value

    @override
    def tally(self) -> Mapping[str, int]:
        controls = [group.control for group in self._groups]
        return {
            "steps": sum(each.accepted for each in controls),
            "rejected": sum(each.rejected for each in controls),
            "forced": sum(each.forced for each in controls),
            "shortest_ns": min((each.shortest for each in controls), default=0),
        }


def _cycles(system: System) -> tuple[frozenset[str], ...]:
    return cycles(system, dependent_groups(system, by_feedthrough=False))


def _watched(
    system: System, exchange: Exchange, names: frozenset[str], degree: int
) -> Iterator[_Watched]:
    """The continuous outputs that those of a group read of each other."""
    direct, others = set(), set()
    for name in in_order(system, names):
        followed = {(feed.component, feed.output) for feed in approximated(system, name)}
        read = {end for end in exchange.participants[name].reads if end[0] in names}
        direct |= read & followed
        others |= read - followed
    for component, output in sorted(direct | others):
        connector = system.connectors[component][output]
        if not connector.is_binary and connector.variability is Variability.CONTINUOUS:
            known = 0 if (component, output) in others else degree
            yield _Watched(exchange.participants[component], output, known)


def _problems(system: System, names: frozenset[str]) -> Iterator[str]:
    """Why those of a cycle cannot choose their steps."""
    ordered = in_order(system, names)
    for name in ordered:
        reasons = [reason_against_repeating(system, name)]
        if system.components[name].capability(VariableSteps) is None:
            reasons.append("its steps cannot differ in length")
        found = " and ".join(reason for reason in reasons if reason is not None)
        if found:
            yield (
                f"`{name}` depends on itself through {path(names, name)}, so adaptive steps have "
                f"to vary its steps and take them back, but {found}; use `algorithm: jacobi` or "
                "`gauss-seidel`, or a connection with a delay"
            )
    sizes = {name: system.step_sizes[name] for name in ordered}
    if len(set(sizes.values())) > 1:
        listed = ", ".join(f"`{name}` {format_duration(h)}" for name, h in sizes.items())
        yield (
            "components that depend on each other need one communication step for adaptive steps; "
            f"these have several: {listed}"
        )
