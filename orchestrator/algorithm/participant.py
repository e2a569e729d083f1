"""One component taking part in a co-simulation: its inputs, its step, its published outputs."""

import abc
from collections.abc import Mapping
from contextlib import nullcontext, suppress
from time import perf_counter_ns
from typing import Any, ClassVar, Final

import numpy as np
from typing_extensions import override

from orchestrator.algorithm.mixing import History, MixedInput, MixSources
from orchestrator.algorithm.outputs import OutputCheck
from orchestrator.component import Component, ConcurrentComponent, RestorableComponent
from orchestrator.errors import ComponentError, CosimError
from orchestrator.native import NativeUnit
from orchestrator.signal import Causality, Connector, Signal, Signals
from orchestrator.system import Feed
from orchestrator.timebase import Duration, Time
from orchestrator.transformation import Mix


class Participant(abc.ABC):
    """A component together with its place in the exchange of signals.

    A step takes three calls, so that an algorithm decides when each happens: `begin` reads
    the inputs and starts the step, `finish` waits for its end and checks the outputs, `publish`
    makes them visible to others. If its component is restorable, the participant can `save` before
    a step, and `restore` to take it again; what others see stays as it is until `publish`.

    Attributes:
        name: of the component in its system.
        step_size: communication step size [ns].
        is_concurrent: whether the step runs elsewhere between `begin` and `finish`.
        is_begun: whether a step has been begun that has not been waited for yet.
        sources: the names of the components it reads.
        published: the outputs that others may see now; updated in place by `publish`.
        wall_time_ns: time spent in calls of the component so far [ns].
    """

    __slots__ = ("_check_outputs", "_component", "_feeds", "_histories", "_mixed",
                 "_pending", "_starts", "is_begun", "name", "published", "sources",
                 "step_size", "wall_time_ns")  # fmt: skip

    is_concurrent: ClassVar[bool]

    def __init__(
        self,
        name: str,
        component: Component,
        connectors: Mapping[str, Connector],
        step_size: Duration,
    ) -> None:
        self.name: Final = name
        self.step_size: Final = step_size
        self.published: Final[dict[str, Signal]] = {}
        self.sources: frozenset[str] = frozenset()
        self.is_begun = False
        self.wall_time_ns = 0
        self._component = component
        self._check_outputs = OutputCheck(connectors).problems
        self._starts = {
            input_: connector.start_value()
            for input_, connector in connectors.items()
            if connector.causality is Causality.INPUT
        }
        self._feeds: tuple[tuple[str, Signals, str], ...] = ()
        self._mixed: tuple[MixedInput, ...] = ()
        self._histories: tuple[History, ...] = ()
        self._pending: Signals = {}

    def connect(self, feeds: tuple[Feed, ...], published: Mapping[str, Signals]) -> None:
        """Read the inputs in `feeds` from what the components `published`, from now on."""
        self.sources = frozenset(feed.component for feed in feeds)
        self._feeds = tuple((feed.input, published[feed.component], feed.output) for feed in feeds)

    def mix(self, mixes: tuple[Mix, ...], sources: MixSources) -> None:
        """Make the inputs in `mixes` of what `sources` has, from now on; after `connect`."""
        self.sources = self.sources.union(*(mix.components for mix in mixes))
        self._mixed = tuple(MixedInput(mix, self._starts[mix.input], sources) for mix in mixes)

    def remember(self, histories: tuple[History, ...]) -> None:
        """Note what is published in `histories`, from now on."""
        self._histories = histories

    def set_up(self, start: Time, stop: Time, rng: np.random.Generator) -> None:
        """Enter the initial state at `start`, of a run that ends at `stop` at the latest."""
        before = perf_counter_ns()
        try:
            self._component.expect_stop(stop)
            self._component.setup(start, rng)
        except Exception as error:
            raise self._failure(start, error) from error
        self.wall_time_ns += perf_counter_ns() - before

    def initialise(self, start: Time) -> None:
        """Compute and publish the outputs at `start` from the inputs known so far."""
        inputs = self._starts.copy()
        for name, values, output in self._feeds:
            if output in values:
                inputs[name] = values[output]
        before = perf_counter_ns()
        try:
            for mixed in self._mixed:
                inputs[mixed.input] = mixed.value()
            self._component.initialise(inputs)
            outputs = self._component.outputs()
            self.wall_time_ns += perf_counter_ns() - before
            self._accept(outputs, start)
        except Exception as error:
            raise self._failure(start, error) from error
        self.publish()

    @abc.abstractmethod
    def begin(self, t: Time) -> None:
        """Start the step from `t`, holding the inputs that are published now."""

    @abc.abstractmethod
    def begin_ahead(self, t: Time) -> None:
        """Start the step from `t` before its turn comes, if it works elsewhere and reads nobody.

        What it sees does not depend on when it steps. If the run ends before its step does, what
        comes of the step is ignored, an error too.
        """

    @abc.abstractmethod
    def finish(self) -> None:
        """Wait until the step that was begun is done, and check its outputs."""

    def publish(self) -> None:
        """Show the outputs of the step finished last to others."""
        self.published.update(self._pending)
        for history in self._histories:
            history.note()

    def show(self, values: Signals) -> None:
        """Let others see `values` in place of these outputs until the next `publish`."""
        self.published.update(values)

    def save(self, t: Time) -> Any:
        """The state of the component at `t`, between two steps.

        Raises:
            ComponentError: the component failed to, or is not restorable.
        """
        before = perf_counter_ns()
        try:
            state = self._restorable().save()
        except Exception as error:
            raise self._failure(t, error, "while saving its state: ") from error
        self.wall_time_ns += perf_counter_ns() - before
        return state

    def restore(self, state: Any, t: Time) -> None:
        """Return the component to `state`, which `save` gave at `t`.

        Raises:
            ComponentError: the component failed to, or is not restorable.
        """
        before = perf_counter_ns()
        try:
            self._restorable().restore(state)
        except Exception as error:
            raise self._failure(t, error, "while restoring its state: ") from error
        self.wall_time_ns += perf_counter_ns() - before

    def _restorable(self) -> RestorableComponent[Any]:
        if isinstance(self._component, RestorableComponent):
            return self._component
        raise ComponentError(self.name, None, "cannot return to an earlier state")

    @abc.abstractmethod
    def settle(self) -> None:
        """Finish a step that was begun, if there is one; its outputs are checked, not shown.

        So a step that fails beyond the end of a run fails wherever the component works.
        """

    def close(self) -> None:
        """Release what the component holds.

        Raises:
            ComponentError: the component failed to.
        """
        try:
            self._component.close()
        except Exception as error:
            raise self._failure(None, error, "while closing: ") from error

    def _inputs(self) -> Signals:
        inputs = self._starts.copy()
        for name, values, output in self._feeds:
            inputs[name] = values[output]
        for mixed in self._mixed:
            inputs[mixed.input] = mixed.value()
        return inputs

    def native(self) -> NativeUnit | None:
        """How to step it without Python, once it is initialised; `None` if that cannot be."""
        return None

    @property
    def pending(self) -> Signals:
        """The outputs of the step finished last."""
        return self._pending

    def go_on(self, published: Signals, pending: Signals, spent_ns: int) -> None:
        """Go on behind steps that were not made here.

        Args:
            published: the outputs that others see now.
            pending: those of the step finished last.
            spent_ns: in calls of the component [ns].
        """
        self.published.update(published)
        self._pending = pending
        self.wall_time_ns += spent_ns

    def check(self, outputs: Signals, t: Time) -> None:
        """Check outputs of a step from `t` that was not made here.

        Raises:
            ComponentError: they break the declaration of the connectors.
        """
        self._accept(outputs, t)

    def failure(self, t: Time | None, error: Exception) -> ComponentError:
        """`error` with the name of the component and the time it worked from."""
        return self._failure(t, error)

    def _accept(self, outputs: Signals, t: Time) -> None:
        """Keep `outputs` for `publish`, or raise what is wrong with them."""
        problems = self._check_outputs(outputs, self.published)
        if problems:
            raise ComponentError(self.name, t, "; ".join(problems))
        self._pending = outputs

    def _failure(self, t: Time | None, error: Exception, doing: str = "") -> ComponentError:
        """`error` with the name of the component and the time it worked from."""
        if isinstance(error, ComponentError):
            when = t if error.time is None else error.time
            return ComponentError(error.component or self.name, when, doing + error.message)
        kind = "" if isinstance(error, CosimError) else f"{type(error).__name__}: "
        return ComponentError(self.name, t, f"{doing}{kind}{error}")


class LocalParticipant(Participant):
    """A component that steps in the calling thread: `begin` does all the work."""

    __slots__ = ()

    is_concurrent = False

    @override
    def native(self) -> NativeUnit | None:
        return self._component.native()

    @override
    def begin(self, t: Time) -> None:
        try:
            inputs = self._inputs()
            before = perf_counter_ns()
            self._component.step(inputs, t, self.step_size)
            outputs = self._component.outputs()
            self.wall_time_ns += perf_counter_ns() - before
            self._accept(outputs, t)
        except Exception as error:
            raise self._failure(t, error) from error

    @override
    def begin_ahead(self, t: Time) -> None:
        pass

    @override
    def finish(self) -> None:
        pass

    @override
    def settle(self) -> None:
        pass


class ConcurrentParticipant(Participant):
    """A component that steps elsewhere between `begin` and `finish`."""

    __slots__ = ("_begun_at", "_concurrent", "_is_ahead")

    is_concurrent = True

    def __init__(
        self,
        name: str,
        component: ConcurrentComponent,
        connectors: Mapping[str, Connector],
        step_size: Duration,
    ) -> None:
        super().__init__(name, component, connectors, step_size)
        self._concurrent = component
        self._begun_at: Time = 0
        self._is_ahead = False

    @override
    def begin(self, t: Time) -> None:
        self._begun_at = t
        try:
            inputs = self._inputs()
            before = perf_counter_ns()
            self._concurrent.begin_step(inputs, t, self.step_size)
        except Exception as error:
            raise self._failure(t, error) from error
        self.is_begun, self._is_ahead = True, False
        self.wall_time_ns += perf_counter_ns() - before

    @override
    def finish(self) -> None:
        self.is_begun = False
        before = perf_counter_ns()
        try:
            self._concurrent.finish_step()
            outputs = self._concurrent.outputs()
            self.wall_time_ns += perf_counter_ns() - before
            self._accept(outputs, self._begun_at)
        except Exception as error:
            raise self._failure(self._begun_at, error) from error

    @override
    def begin_ahead(self, t: Time) -> None:
        if not self.sources:
            self.begin(t)
            self._is_ahead = True

    @override
    def settle(self) -> None:
        if self.is_begun:
            with suppress(ComponentError) if self._is_ahead else nullcontext():
                self.finish()


def participant(
    name: str, component: Component, connectors: Mapping[str, Connector], step_size: Duration
) -> Participant:
    """The participant that suits the capabilities of `component`."""
    if isinstance(component, ConcurrentComponent):
        return ConcurrentParticipant(name, component, connectors, step_size)
    return LocalParticipant(name, component, connectors, step_size)
