"""An FMU as a component."""

import math
import weakref
from collections.abc import Callable, Collection, Mapping, Sequence
from typing import Any, TypeAlias

import numpy as np
from typing_extensions import override

from adapters.fmi.block import shape_of
from adapters.fmi.chance import drawn, redrawing, seed_of
from adapters.fmi.connectors import SEED, connectors
from adapters.fmi.derivatives import derivatives
from adapters.fmi.description import FmuDescription
from adapters.fmi.errors import FmuError
from adapters.fmi.instance import FmuInstance
from adapters.fmi.portable import PortableFmu
from adapters.fmi.rates import FmuCourses, offered
from adapters.fmi.sizes import Sizes
from adapters.fmi.state import FmuState
from adapters.fmi.stepping import Stepper
from adapters.fmi.variable import DTYPES, FmuVariable
from orchestrator.algorithm.outputs import same
from orchestrator.capabilities import (
    EndRequest,
    EndRequesting,
    InitialEvaluation,
    OutputSelection,
)
from orchestrator.component import Capability, Component, WrappedRestorableComponent
from orchestrator.native import NativeOwner, NativeUnit
from orchestrator.signal import Causality, Connector, Signal, Signals, Variability
from orchestrator.timebase import CommunicationGrid, Duration, Time, seconds

Instantiate: TypeAlias = Callable[[], FmuInstance]
"""Makes a new instance of the FMU, with its own folder and library."""


class FmuComponent(Component, NativeOwner, InitialEvaluation, EndRequesting, OutputSelection):
    """An FMU in this process.

    Inputs that are the objects they were at the last step are not set again. When the length
    of a named axis changes, the FMU is reconfigured and every array along that axis is set
    again (FMI 3.0.2, section 2.2.9).

    Args:
        description: of the FMU.
        values: of parameters, and start values of what is neither parameter nor input.
        instantiate: makes the instance.
        stepper: takes its steps.
        tolerance: relative, for the solver of the FMU; `None`: its own.
    """

    def __init__(
        self,
        description: FmuDescription,
        values: Mapping[str, Any],
        instantiate: Instantiate,
        *,
        stepper: Stepper,
        tolerance: float | None,
    ) -> None:
        self._description = description
        self._values = values
        self._tolerance = tolerance
        self._stepper = stepper
        self._instantiate = instantiate
        self._sizes = Sizes(description, values)
        self._connectors = connectors(description, self._sizes.start, self._sizes.settled)
        self._inputs = [
            name for name, c in self._connectors.items() if c.causality is Causality.INPUT
        ]
        own = {e: v for v in description.of("input") for e in v.elements}
        self._input_clocks = [n for n in self._inputs if own[n].clock is not None]
        self._inputs = [n for n in self._inputs if own[n].clock is None]
        self._jumping = {
            n
            for n in self._inputs
            if self._connectors[n].variability is not Variability.CONTINUOUS
            and not own[n].is_clocked  # those wait for their clock
        }
        self._courses = FmuCourses(description)
        self._offered = derivatives(description, self._running)
        self._offered += offered(description, self._courses, self._running)
        self._offered += redrawing(description, self._running)
        if description.can_restore and description.can_serialize and not description.has_clocks:
            self._offered.append(PortableFmu(description, self, self._running))
        arrays = [v for v in description.of("input") if v.is_bytes and v.axes]
        self._siblings = {name: v.elements for v in arrays for name in v.elements}
        self._instance: FmuInstance | None = None
        self._finalizer: weakref.finalize[..., FmuComponent] | None = None
        self._lengths: dict[str, int] = {}
        self._written: dict[str, Signal] = {}
        self._read: Signals = {}
        self._seed: int | None = None
        self._start: Time = 0
        self._grid: CommunicationGrid | None = None
        self._is_initialising = False
        self._end_request: EndRequest | None = None

    @property
    @override
    def connectors(self) -> Mapping[str, Connector]:
        return self._connectors

    @override
    def expect(self, grid: CommunicationGrid) -> None:
        self._grid = grid

    @override
    def setup(self, start: Time, rng: np.random.Generator) -> None:
        self.close()
        self._start = start
        self._seed = self._draw_seed(rng)
        self._instance = self._instantiate()
        self._is_initialising, self._end_request = False, None
        self._courses.forget()
        # also at interpreter exit, when `close` was never called
        self._finalizer = weakref.finalize(self, self._instance.free)

    def _draw_seed(self, rng: np.random.Generator) -> int | None:
        variable = seed_of(self._description)
        return None if variable is None or SEED in self._values else drawn(variable, rng)

    def _running(self) -> FmuInstance:
        if self._instance is None:
            raise FmuError("the FMU is not running: `setup` comes first")
        return self._instance

    @override
    def capability(self, kind: type[Capability]) -> Capability | None:
        if kind is InitialEvaluation and self._sizes.may_change:
            return None  # sizes are set before initialisation, once
        for each in self._offered:
            if isinstance(each, kind):
                return each
        return super().capability(kind)

    @override
    def evaluate(self, inputs: Signals) -> Signals:
        instance = self._running()
        self._enter_initialisation(instance, inputs)
        self._write_inputs(instance, inputs)
        return instance.read()

    @override
    def initialise(self, inputs: Signals) -> None:
        instance = self._running()
        self._enter_initialisation(instance, inputs)
        self._write_inputs(instance, inputs)
        if instance.exit_initialisation(seconds(self._start)):
            self._end_request = self._stepper.request(self._start)
        self._read = instance.read()

    def _enter_initialisation(self, instance: FmuInstance, inputs: Signals) -> None:
        """Set sizes and parameters and enter initialisation mode, once."""
        if self._is_initialising:
            return
        self._is_initialising = True
        self._lengths = self._sizes.measure(inputs)
        declared = {v.name: v for v in self._description.of("structuralParameter") if v.start}
        changed = {n: k for n, k in self._lengths.items() if k != declared[n].start[0]}
        if changed:
            instance.configure(changed)
        self._set_parameters(instance)
        instance.enter_initialisation(
            seconds(self._start),
            stop=None if self._grid is None else seconds(self._grid.stop),
            tolerance=self._tolerance,
        )
        self._written = {}

    def _set_parameters(self, instance: FmuInstance) -> None:
        values = {n: v for n, v in self._values.items() if n not in self._lengths}
        if self._seed is not None:
            values[SEED] = self._seed
        variables = self._description.variables
        texts = {
            name: (value,) if isinstance(value, str) else tuple(value)
            for name, value in values.items()
            if variables[name].type == "String"
        }
        instance.write_text(self._whole(texts))
        instance.write(
            {
                name: self._as_array(self._description.variables[name], value)
                for name, value in values.items()
                if name not in texts
            }
        )

    def _whole(self, texts: Mapping[str, tuple[str, ...]]) -> dict[str, tuple[str, ...]]:
        """All elements of arrays of which one stands for all."""
        counts = {
            n: math.prod(shape_of(self._description.variables[n], self._lengths)) for n in texts
        }
        return {n: t * counts[n] if len(t) == 1 else t for n, t in texts.items()}

    def _as_array(self, variable: FmuVariable, value: Any) -> Signal:
        """A parameter value in the element type and the shape of its variable.

        Raises:
            FmuError: the type cannot hold it.
        """
        try:
            elements = np.asarray(value, dtype=DTYPES[variable.type])
        except (OverflowError, ValueError, TypeError) as error:
            raise FmuError(f"`{variable.name}` cannot be {value!r}: {error}") from error
        shape = shape_of(variable, self._lengths)
        return np.full(shape, elements) if elements.size == 1 else elements.reshape(shape)

    def _write_inputs(
        self, instance: FmuInstance, inputs: Signals, begin: float | None = None
    ) -> bool:
        """Set what is new; at the time `begin` [s], some of it may jump.

        Returns:
            Whether the FMU asks to end the simulation.
        """
        written = self._written
        is_jumping = begin is not None and instance.uses_events
        changed = {}
        for name in self._inputs:
            value, old = inputs[name], written.get(name)
            if value is not old:
                written[name] = value
                if is_jumping and old is not None and name in self._jumping and same(value, old):
                    continue  # no event
                changed[name] = self._sizes.fill(name, value, self._lengths)
                for other in self._siblings.get(name, ()):
                    changed[other] = inputs[other]
        if begin is not None and is_jumping:
            ticking = {n: inputs[n] for n in self._input_clocks if np.any(inputs[n])}
            if ticking or not self._jumping.isdisjoint(changed):
                return instance.write_jumps(changed | ticking, begin)
        if changed:
            instance.write(changed)
        return False

    @override
    def step(self, inputs: Signals, t: Time, h: Duration) -> None:
        instance = self._running()
        if self._sizes.may_have_changed(inputs, self._written):
            self._resize(instance, inputs)
        begin, length = self._span(t, h)
        instance.begin_step()
        if self._write_inputs(instance, inputs, begin):
            self._end_request = self._stepper.request(t)
            return
        self._courses.tell(instance, begin, length)
        self._end_request = self._stepper.make(instance, begin, length, t + h)
        if self._end_request is None or self._end_request.time == t + h:
            self._read = instance.read()

    def _span(self, t: Time, h: Duration) -> tuple[float, float]:
        """Where the step from `t` to `t + h` begins, and its length [s]."""
        if self._grid is None:
            return seconds(t), seconds(h)
        return self._grid.seconds(t), self._grid.length(t, h)

    @property
    @override
    def end_request(self) -> EndRequest | None:
        return self._end_request

    def _resize(self, instance: FmuInstance, inputs: Signals) -> None:
        lengths = self._sizes.measure(inputs)
        changed = {name: n for name, n in lengths.items() if n != self._lengths[name]}
        if changed:
            instance.configure(changed)
            self._lengths = lengths
            for name in self._sizes.along(set(changed)):
                self._written.pop(name, None)

    @override
    def outputs(self) -> Signals:
        return self._read

    @override
    def select(self, names: Collection[str] | None) -> None:
        instance = self._running()
        instance.select(names)
        if names is None:
            self._read = instance.read()
        else:
            self._read = {name: self._read[name] for name in self._read if name in names}

    @override
    def native(self) -> NativeUnit | None:
        instance = self._running()
        if self._sizes.may_change or self._stepper.keeps_states or instance.uses_events:
            return None
        return instance.native(self._connectors, self)

    @override
    def count_calls(self, address: int | None) -> None:
        self._running().count_calls(address)

    @override
    def is_written(self, name: str, value: Signal) -> bool:
        return self._written.get(name) is value

    @override
    def adopt(self, driven: Sequence[str], written: Mapping[str, Signal], read: Signals) -> None:
        for name in driven:
            self._written.pop(name, None)
        self._written.update(written)
        self._read = read

    @override
    def setting_failed(self, type_: str, names: Sequence[str], status: int) -> None:
        self._running().setting_failed(type_, names, status)

    @override
    def complete_step(self, status: int, t: Time, h: Duration) -> None:
        instance = self._running()
        begin, length = self._span(t, h)
        outcome = instance.outcome(status, begin)
        self._end_request = self._stepper.go_on(instance, outcome, begin, length, t + h)

    @override
    def getting_failed(self, type_: str, status: int) -> None:
        self._running().getting_failed(type_, status)

    @override
    def close(self) -> None:
        self._stepper.account()
        if self._finalizer is not None:
            self._finalizer()
        self._finalizer = None
        self._instance = None

    def save(self) -> FmuState:
        """The state of the FMU and of this importer."""
        instance = self._running()
        state = FmuState(
            instance=instance,
            address=instance.save(),
            lengths=dict(self._lengths),
            written=dict(self._written),
            read=self._read,
        )
        weakref.finalize(state, instance.forget, state.address)
        return state

    def restore(self, state: FmuState) -> None:
        """Return to `state`."""
        instance = self._running()
        if state.instance is not instance:
            raise FmuError("the state belongs to an instance that was closed")
        instance.restore(state.address, state.lengths)
        self._lengths = dict(state.lengths)
        self._written = dict(state.written)
        self._read = state.read


class RestorableFmuComponent(WrappedRestorableComponent[FmuState]):
    """An FMU that can return to an earlier state (FMI: `canGetAndSetFMUState`)."""

    def __init__(self, component: FmuComponent) -> None:
        super().__init__(component, component)
