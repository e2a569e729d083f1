"""The contract of components as code that anybody can run on theirs, and a component for tests."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from typing_extensions import override

from orchestrator.algorithm.outputs import OutputCheck, same
from orchestrator.capabilities import InitialEvaluation
from orchestrator.component import (
    Component,
    ConcurrentComponent,
    DecidingComponent,
    RestorableComponent,
)
from orchestrator.errors import ComponentError
from orchestrator.randomness import stream
from orchestrator.signal import Causality, Connector, Signal, Signals
from orchestrator.timebase import CommunicationGrid, Duration, Time

Inputs: TypeAlias = Callable[[Time], Signals]
"""The driven inputs at a communication point; the others carry their start values."""

Function: TypeAlias = Callable[[Any, Signals, Time], tuple[Any, Signals]]
"""From state, inputs and time to the new state and the outputs at that time."""

Trace: TypeAlias = list[dict[str, Signal]]
"""Copies of the outputs at each communication point."""


class FunctionComponent(RestorableComponent[tuple[Any, Signals]], InitialEvaluation):
    """A component made of one function, for tests and examples.

    The function is called at the first communication point and at the end of every step with
    the state it returned last, the inputs of the step and the time reached. State and outputs
    must be new objects each time.

    Args:
        connectors: by name.
        function: `(state, inputs, time) -> (state, outputs)`.
        state: the state before the first call.
    """

    def __init__(
        self, connectors: Mapping[str, Connector], function: Function, state: Any = None
    ) -> None:
        self._connectors = connectors
        self._function = function
        self._first = state
        self._start: Time = 0
        self._state = state
        self._outputs: Signals = {}

    @property
    @override
    def connectors(self) -> Mapping[str, Connector]:
        return self._connectors

    @override
    def setup(self, start: Time, rng: np.random.Generator) -> None:
        self._start = start
        self._state = self._first

    @override
    def initialise(self, inputs: Signals) -> None:
        self._state, self._outputs = self._function(self._state, inputs, self._start)

    @override
    def evaluate(self, inputs: Signals) -> Signals:
        return self._function(self._state, inputs, self._start)[1]

    @override
    def step(self, inputs: Signals, t: Time, h: Duration) -> None:
        self._state, self._outputs = self._function(self._state, inputs, t + h)

    @override
    def outputs(self) -> Signals:
        return self._outputs

    @override
    def save(self) -> tuple[Any, Signals]:
        return self._state, self._outputs

    @override
    def restore(self, state: tuple[Any, Signals]) -> None:
        self._state, self._outputs = state


def check_component(
    component: Component,
    *,
    steps: int = 3,
    h: Duration = 100_000_000,
    seed: int = 0,
    inputs: Inputs | None = None,
) -> None:
    """Check that `component` keeps the contract of `Component` and of its capabilities.

    It writes exactly the outputs it declares, as declared; writes neither to its inputs nor to
    arrays it handed out; repeats itself exactly when set up again with the same seed; `outputs`
    has no effect; `close` may be called before `setup` and twice. A `RestorableComponent` returns
    to a saved state any number of times; a `ConcurrentComponent` gives the same in one call or
    two; of the decisions of a `DecidingComponent` the first alternative is taken.

    Args:
        component: the component, as created.
        steps: how many communication steps to take.
        h: communication step size [ns].
        seed: of its random stream.
        inputs: what drives it; without, all inputs keep their start values.

    Raises:
        ComponentError: it does not; the message says what it did.
    """
    check = _Check(component, CommunicationGrid(0, h, steps), seed, inputs)
    component.close()
    first = check.run(_step)
    check.compare(first, check.run(_step), f"differs between two runs with seed {seed}")
    check.compare(first, check.run(_look_twice), "changes when `outputs` is called more often")
    if isinstance(component, RestorableComponent):
        check.compare(first, check.run(_step_again), "differs after `restore`")
    if isinstance(component, ConcurrentComponent):
        check.compare(first, check.run(_begin_and_finish), "differs with `begin_step`")


def _step(component: Component, inputs: Signals, t: Time, h: Duration) -> None:
    component.step(inputs, t, h)


def _look_twice(component: Component, inputs: Signals, t: Time, h: Duration) -> None:
    component.outputs()
    component.outputs()
    component.step(inputs, t, h)


def _step_again(component: Any, inputs: Signals, t: Time, h: Duration) -> None:
    state = component.save()
    for _ in range(2):
        component.step(inputs, t, h)
        component.outputs()
        component.restore(state)
    component.step(inputs, t, h)


def _take_first(component: Component) -> None:
    if isinstance(component, DecidingComponent) and component.decision is not None:
        component.decide(0)


def _begin_and_finish(component: Any, inputs: Signals, t: Time, h: Duration) -> None:
    component.begin_step(inputs, t, h)
    component.finish_step()


@dataclass(frozen=True, slots=True)
class _Handed:
    """Signals that crossed the border, and copies of them as they were then."""

    what: str
    at: Time
    signals: Signals
    copies: dict[str, Signal]

    @classmethod
    def over(cls, what: str, at: Time, signals: Signals) -> "_Handed":
        return cls(what, at, dict(signals), {name: _copy(s) for name, s in signals.items()})


@dataclass(frozen=True, slots=True)
class _Check:
    """Runs of one component under equal conditions."""

    component: Component
    grid: CommunicationGrid
    seed: int
    inputs: Inputs | None

    def run(self, step: Callable[[Component, Signals, Time, Duration], None]) -> Trace:
        """Outputs at each communication point; `step` takes one step."""
        component = self.component
        find_problems = OutputCheck(component.connectors).problems
        crossed: list[_Handed] = []
        trace: Trace = []

        def take_in(t: Time) -> Signals:
            crossed.append(_Handed.over("wrote to its input", t, self._inputs_at(t)))
            return dict(crossed[-1].signals)

        def hand_out(t: Time) -> None:
            outputs = component.outputs()
            self._raise(t, find_problems(outputs, trace[-1] if trace else {}))
            crossed.append(_Handed.over("changed an array it had handed out,", t, outputs))
            trace.append(crossed[-1].copies)

        component.setup(self.grid.start, stream(self.seed, self._name))
        try:
            component.initialise(take_in(self.grid.start))
            hand_out(self.grid.start)
            for t in self.grid:
                end = self.grid.after(t)
                step(component, take_in(t), t, end - t)
                _take_first(component)
                hand_out(end)
            self._raise_changes(crossed)
        finally:
            component.close()
            component.close()
        return trace

    def compare(self, first: Trace, second: Trace, how: str) -> None:
        """Raise where two runs differ."""
        for k, (before, after) in enumerate(zip(first, second, strict=True)):
            t = self.grid.at(k)
            different = [name for name in before if not same(before[name], after[name])]
            self._raise(t, [f"output `{name}` {how}" for name in different])

    @property
    def _name(self) -> str:
        return type(self.component).__name__

    def _inputs_at(self, t: Time) -> Signals:
        driven = {} if self.inputs is None else self.inputs(t)
        inputs = {
            name: driven.get(name, connector.start_value())
            for name, connector in self.component.connectors.items()
            if connector.causality is Causality.INPUT
        }
        for signal in inputs.values():
            if isinstance(signal, np.ndarray):
                signal.flags.writeable = False
        return inputs

    def _raise_changes(self, crossed: list[_Handed]) -> None:
        for handed in crossed:
            for name, copy in handed.copies.items():
                if not same(handed.signals[name], copy):
                    self._raise(handed.at, [f"{handed.what} `{name}`"])

    def _raise(self, t: Time, problems: list[str]) -> None:
        if problems:
            raise ComponentError(self._name, t, "; ".join(problems))


def _copy(signal: Signal) -> Signal:
    return signal if isinstance(signal, bytes) else signal.copy()
