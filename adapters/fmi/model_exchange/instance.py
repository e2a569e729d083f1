"""An FMU for Model Exchange as one that can be stepped."""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import NoReturn, TypeAlias

import numpy as np
from typing_extensions import override

from adapters.fmi.block import shape_of
from adapters.fmi.description import FmuDescription
from adapters.fmi.errors import FmuError
from adapters.fmi.instance import FmuInstance
from adapters.fmi.loaded import LoadedInstance
from adapters.fmi.model_exchange.equation import Equation
from adapters.fmi.model_exchange.functions import Functions2, Functions3
from adapters.fmi.model_exchange.integration import Integration, Moment
from adapters.fmi.model_exchange.model import ContinuousModel
from adapters.fmi.model_exchange.solver import Problem, Solver
from adapters.fmi.outcome import MADE, StepOutcome
from orchestrator.algorithm.outputs import same
from orchestrator.course import Course
from orchestrator.native import NativeOwner, NativeUnit
from orchestrator.signal import Array, Connector, Signal

MakeSolver: TypeAlias = Callable[[Problem], Solver]


@dataclass(frozen=True, slots=True, kw_only=True)
class _Kept:
    """What the importer knew when an FMU state was stored."""

    moment: Moment
    held: Mapping[str, Signal]
    pending: Mapping[str, Signal]


class ModelExchangeInstance(FmuInstance):
    """Steps by integration.

    Inputs that are written between two steps wait for the next one, which begins with an event if
    any of them jumps (FMI 3.0.2, section 3.2.1); outputs that are read before are those of the
    continuous inputs that wait.

    Args:
        loaded: the instance, for everything that every FMU has.
        description: of the FMU.
        model: its equation.
        make_solver: for the equation.
        may_restore: whether a step may be followed by a return to a state before it.
    """

    def __init__(
        self,
        loaded: LoadedInstance,
        description: FmuDescription,
        model: ContinuousModel,
        make_solver: MakeSolver,
        *,
        may_restore: bool,
    ) -> None:
        self._loaded, self._description, self._model = loaded, description, model
        self._make_solver = make_solver
        self._may_restore = may_restore
        inputs = description.of("input")
        self._inputs = {name for v in inputs for name in v.elements}
        self._continuous = {v.name for v in inputs if v.variability == "continuous"}
        self._held: dict[str, Signal] = {}
        self._pending: dict[str, Signal] = {}
        self._courses: Mapping[str, Course] = {}
        self._kept: dict[int, _Kept] = {}
        self._integration: Integration | None = None

    @override
    def configure(self, lengths: Mapping[str, int]) -> None:
        if self._integration is not None:
            changed = ", ".join(f"`{name}`" for name in lengths)
            raise FmuError(f"{changed} cannot change during a run with Model Exchange")
        self._loaded.configure(lengths)

    @override
    def write(self, values: Mapping[str, Signal]) -> None:
        inputs = {name: value for name, value in values.items() if name in self._inputs}
        if self._integration is None:
            self._loaded.write(values)
            self._held.update(inputs)
        else:
            self._pending.update(inputs)

    @override
    def write_text(self, values: Mapping[str, Sequence[str]]) -> None:
        self._loaded.write_text(values)

    @override
    def enter_initialisation(
        self, t: float, *, stop: float | None, tolerance: float | None
    ) -> None:
        self._loaded.enter_initialisation(t, stop=stop, tolerance=tolerance)

    @property
    @override
    def uses_events(self) -> bool:
        return False  # the component need not: all jumps wait for the next step

    @override
    def begin_step(self) -> None:
        pass

    @override
    def write_jumps(self, values: Mapping[str, Signal], t: float) -> bool:
        self.write(values)
        return False

    @override
    def exit_initialisation(self, t: float) -> bool:
        self._loaded.exit_initialisation(t)
        handle = self._loaded.handle
        version = self._description.version
        functions = Functions2(handle) if version == 2 else Functions3(handle)
        states, indicators = functions.counts(len(self._model.states), self._model.indicators)
        equation = Equation(functions, states, indicators, self._references(states))
        self._integration = Integration(
            functions,
            equation,
            self._make_solver(equation) if states or indicators else None,
            count=states,
            hears_steps=self._model.needs_completed_steps,
            keeps_state=not self._may_restore,
        )
        return self._integration.begin(t)

    def _references(self, states: int) -> tuple[Array, Array] | None:
        """The value references of states and derivatives, for a Jacobian."""
        model = self._model
        if not model.has_directional or not states or states != len(model.states):
            return None
        both = [
            np.array([v.reference for v in each], np.uint32) for each in (model.states, model.rates)
        ]
        return both[0], both[1]

    def _running(self) -> Integration:
        if self._integration is None:
            raise FmuError("the FMU is not initialised")
        return self._integration

    def follow(self, courses: Mapping[str, Course]) -> None:
        """Let these inputs change over the next step; see `CourseFollowing`."""
        self._courses = courses

    @override
    def step(self, t: float, h: float) -> StepOutcome:
        integration = self._running()
        courses, self._courses = self._courses, {}
        if self._take_inputs(integration):
            return StepOutcome(time=t, wants_end=True)
        self._drive(integration.equation, courses, t, h)
        try:
            wants_end = integration.advance(t, t + h)
        finally:
            integration.equation.drive = None
        self._held.update({name: course.at(1.0) for name, course in courses.items()})
        return StepOutcome(time=integration.moment.now, wants_end=True) if wants_end else MADE

    def _jumps(self) -> dict[str, Signal]:
        """The inputs that wait and are not what they were."""
        held = self._held
        return {name: v for name, v in self._pending.items() if not same(v, held[name])}

    def _take_inputs(self, integration: Integration) -> bool:
        """Set the inputs that wait, at an event; whether the FMU asks to end the simulation."""
        jumps = self._jumps()
        self._pending = {}
        if not jumps:
            return False
        integration.enter_event_mode()
        self._loaded.write(jumps)
        self._held.update(jumps)
        return integration.leave_event_mode()

    def _drive(self, equation: Equation, courses: Mapping[str, Course], t: float, h: float) -> None:
        if not courses:
            return
        write = self._loaded.write

        def drive(now: float) -> None:
            write({name: course.at((now - t) / h) for name, course in courses.items()})

        equation.drive = drive

    @override
    def select(self, names: Collection[str] | None) -> None:
        self._loaded.select(names)

    @override
    def read(self) -> dict[str, Signal]:
        waiting = self._jumps()
        if self._may_restore and not waiting.keys() <= self._continuous:
            return self._tried()
        waiting = {name: value for name, value in waiting.items() if name in self._continuous}
        if not waiting:
            return self._loaded.read()
        self._loaded.write(waiting)
        try:
            return self._loaded.read()
        finally:
            self._loaded.write({name: self._held[name] for name in waiting})

    def _tried(self) -> dict[str, Signal]:
        """The outputs behind the event that the next step begins with."""
        address = self.save()
        try:
            self._take_inputs(self._running())
            return self._loaded.read()
        finally:
            self.restore(address, None)
            self.forget(address)

    def slopes(self) -> dict[str, Signal]:
        """The derivatives of those outputs that are states, float64, each of its shape."""
        rates = self._running().rates()
        found: dict[str, Signal] = {}
        start = 0
        for state in self._model.states:
            shape = shape_of(state, self.lengths)
            stop = start + int(np.prod(shape, dtype=np.int64))
            if state.causality == "output" and stop <= len(rates):
                found[state.name] = rates[start:stop].reshape(shape)
            start = stop
        return found

    @override
    def save(self) -> int:
        address = self._loaded.save()
        moment = self._running().moment
        self._kept[address] = _Kept(
            moment=moment, held=dict(self._held), pending=dict(self._pending)
        )
        return address

    @property
    @override
    def lengths(self) -> Mapping[str, int]:
        return self._loaded.lengths

    @override
    def directional(self, unknowns: Sequence[str], knowns: Sequence[str], seed: Array) -> Array:
        return self._loaded.directional(unknowns, knowns, seed)

    @override
    def adjoint(self, unknowns: Sequence[str], knowns: Sequence[str], seed: Array) -> Array:
        return self._loaded.adjoint(unknowns, knowns, seed)

    @override
    def serialize(self, state: int) -> bytes:
        raise FmuError("a state of Model Exchange is no bytes")

    @override
    def deserialize(self, content: bytes) -> int:
        raise FmuError("bytes are no state of Model Exchange")

    @override
    def restore(self, state: int, lengths: Mapping[str, int] | None) -> None:
        self._loaded.restore(state, lengths)
        kept = self._kept[state]
        self._held, self._pending = dict(kept.held), dict(kept.pending)
        self._running().resume(kept.moment)

    @override
    def forget(self, state: int) -> None:
        self._kept.pop(state, None)
        self._loaded.forget(state)

    @override
    def free(self) -> None:
        if self._integration is not None:
            self._integration.free()
        self._loaded.free()

    @override
    def native(self, connectors: Mapping[str, Connector], owner: NativeOwner) -> NativeUnit | None:
        return None

    @override
    def count_calls(self, address: int | None) -> None:
        self._loaded.count_calls(address)

    @override
    def setting_failed(self, type_: str, names: Sequence[str], status: int) -> None:
        self._loaded.setting_failed(type_, names, status)

    @override
    def outcome(self, status: int, t: float) -> StepOutcome:
        return self._loaded.outcome(status, t)

    @override
    def discarded(self, reached: float, hint: str) -> NoReturn:
        self._loaded.discarded(reached, hint)

    @override
    def getting_failed(self, type_: str, status: int) -> None:
        self._loaded.getting_failed(type_, status)
