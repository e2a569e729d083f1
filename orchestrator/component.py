"""The contract between the orchestrator and everything it steps.

The life cycle mirrors FMI: create with parameters, `setup`, `initialise`, then any number
of communication steps, then `close`. Optional capabilities are abstract subclasses, asked
for once, when a system is assembled.
"""

import abc
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Generic, Protocol, TypeVar

import numpy as np
from typing_extensions import override

from orchestrator.native import NativeUnit
from orchestrator.signal import Connector, Signals
from orchestrator.timebase import CommunicationGrid, Duration, Time

State = TypeVar("State")
Capability = TypeVar("Capability")


class Component(abc.ABC):
    """One subsystem of a co-simulation.

    Guaranteed order of calls: `expect`, `setup`, `initialise`, (`step`)*, `close`; `outputs`
    at any point between `initialise` and `close`. `close` is called also after an error.

    Signals are handed over, not copied: an array given to a component is read-only, and an
    array returned by `outputs` is never written to again by the component (it becomes
    read-only too). A value that did not change may be the same object as before; receivers
    use that to skip work.

    A component reads no clock, no environment and no randomness but the generator given to
    `setup`, so that equal inputs give equal bytes wherever it runs. Anything it raises ends
    the run with its name and the simulated time.
    """

    @property
    @abc.abstractmethod
    def connectors(self) -> Mapping[str, Connector]:
        """The signals this component exchanges, by name; constant after creation.

        A class whose instances all have the same ones may declare them as an attribute. Names
        may be structured with dots (`vehicle.position`); a scenario can connect such a group at
        once.
        """

    @abc.abstractmethod
    def setup(self, start: Time, rng: np.random.Generator) -> None:
        """Acquire what is needed and enter the initial state at time `start`.

        Called again after `close`, it must repeat the same run.

        Args:
            start: the first communication point.
            rng: the component's own random stream; its only source of randomness.
        """

    def expect(self, grid: CommunicationGrid) -> None:
        """Hear when communication points come; called before each `setup`, if that is known.

        A component that has no use for that does nothing.

        Args:
            grid: from the start of the run to where it ends at the latest.
        """

    def initialise(self, inputs: Signals) -> None:
        """Compute the outputs at the first communication point from `inputs`.

        Called once, in the order of direct feedthrough, so that inputs driven by outputs
        already known carry their values and all others their start values. A component
        without feedthrough has nothing to do.
        """

    @abc.abstractmethod
    def step(self, inputs: Signals, t: Time, h: Duration) -> None:
        """Advance from `t` to `t + h`, holding `inputs` constant.

        Args:
            inputs: every input connector by name; unconnected ones carry start values.
            t: the current communication point.
            h: the communication step size; the same at every step unless the component says that
                it may differ (`orchestrator.capabilities.VariableSteps`). Of a step size such as
                1/60 s the nearest whole number that ends at the next communication point.
        """

    @abc.abstractmethod
    def outputs(self) -> Signals:
        """Every output connector by name, at the current communication point. No effect."""

    def capability(self, kind: type[Capability]) -> Capability | None:
        """This component as a `kind` of `orchestrator.capabilities`; `None` if it is none.

        A component that finds out by itself what it can do, such as an FMU, overrides this.
        """
        return self if isinstance(self, kind) else None

    def native(self) -> NativeUnit | None:
        """How compiled code can take the steps from here on; `None`, the default: it cannot.

        Asked for once, after `initialise`. Whoever has it may step the unit in place of `step` and
        `outputs`, and tells its owner about it.
        """
        return None

    def close(self) -> None:
        """Release what `setup` acquired. Calling it twice, or before `setup`, is harmless."""


class RestorableComponent(Component, Generic[State]):
    """A component that can return to an earlier state (FMI: `canGetAndSetFMUState`)."""

    @abc.abstractmethod
    def save(self) -> State:
        """A copy of the complete state, random state and pending work included."""

    @abc.abstractmethod
    def restore(self, state: State) -> None:
        """Return to `state`, exactly; the state may be restored any number of times."""


class ConcurrentComponent(Component):
    """A component whose step can run while others step, e.g. in another process.

    `step(inputs, t, h)` is `begin_step(inputs, t, h)` followed by `finish_step()`, or equals that.
    """

    @override
    def step(self, inputs: Signals, t: Time, h: Duration) -> None:
        self.begin_step(inputs, t, h)
        self.finish_step()

    @abc.abstractmethod
    def begin_step(self, inputs: Signals, t: Time, h: Duration) -> None:
        """Start to advance from `t` to `t + h` and return without waiting."""

    @abc.abstractmethod
    def finish_step(self) -> None:
        """Wait until the step that was begun is done; raise what it raised."""

    def has_finished(self) -> bool:
        """Whether the step that was begun is done without an error; `False` also if unknown.

        Then `finish_step` does not wait. What goes wrong is no matter of this call.
        """
        return False


class OncePerProcessComponent(Component):
    """A component that holds what a process can have only one of, e.g. a library's global state."""

    @classmethod
    @abc.abstractmethod
    def once_per_process(cls, parameters: Any) -> str | None:
        """The name of what an instance holds; `None` if an instance with them holds nothing such.

        Args:
            parameters: an instance of the class's `Parameters`.
        """


class ForeseenComponent(Component):
    """A component whose connectors are known, but for names, before its parameters are."""

    @classmethod
    @abc.abstractmethod
    def foreseen_connectors(cls) -> Mapping[str, Connector]:
        """The connectors of an instance, with `<word>` where its parameters give a name."""


class WrappedComponent(Component):
    """A component around another one, to which it passes on every call but `step`.

    Args:
        wrapped: the other one.
    """

    def __init__(self, wrapped: Component) -> None:
        self._wrapped = wrapped

    @property
    @override
    def connectors(self) -> Mapping[str, Connector]:
        return self._wrapped.connectors

    @override
    def setup(self, start: Time, rng: np.random.Generator) -> None:
        self._wrapped.setup(start, rng)

    @override
    def expect(self, grid: CommunicationGrid) -> None:
        self._wrapped.expect(grid)

    @override
    def initialise(self, inputs: Signals) -> None:
        self._wrapped.initialise(inputs)

    @override
    def outputs(self) -> Signals:
        return self._wrapped.outputs()

    @override
    def capability(self, kind: type[Capability]) -> Capability | None:
        return self._wrapped.capability(kind)

    @override
    def native(self) -> NativeUnit | None:
        return self._wrapped.native()

    @override
    def close(self) -> None:
        self._wrapped.close()


class StateKeeper(Protocol[State]):
    """Something whose state can be saved and restored, as of a `RestorableComponent`."""

    def save(self) -> State:
        """A copy of the complete state."""

    def restore(self, state: State) -> None:
        """Return to `state`."""


class WrappedRestorableComponent(WrappedComponent, RestorableComponent[State]):
    """A component around another one that turned out to be able to return to an earlier state.

    Args:
        wrapped: the other one.
        keeper: of its state.
    """

    def __init__(self, wrapped: Component, keeper: StateKeeper[State]) -> None:
        super().__init__(wrapped)
        self._keeper = keeper

    @override
    def step(self, inputs: Signals, t: Time, h: Duration) -> None:
        self._wrapped.step(inputs, t, h)

    @override
    def save(self) -> State:
        return self._keeper.save()

    @override
    def restore(self, state: State) -> None:
        self._keeper.restore(state)


@dataclass(frozen=True, slots=True, kw_only=True)
class Decision:
    """A choice that a component leaves to its outcome.

    Attributes:
        alternatives: a few words for each, for messages; at least one. Of several equally
            good ones the first is taken, so their order matters.
        horizon: when the outcome of each is read [ns].
        draws: 0 to try each with the random numbers that the run will have; else with how many
            others, drawn anew in the components that are `Redrawing`, and the best mean counts.
    """

    alternatives: tuple[str, ...]
    horizon: Time
    draws: int = 0


class DecidingComponent(Component):
    """A component whose choices are made by trying: each alternative in a copy of the system.

    `step` may open a decision. The simulation then copies the whole system once for each
    alternative, lets each branch run to the horizon, reads its score, and calls `decide` with
    the best before it asks for `outputs`; see `orchestrator.branching`. Within a branch the
    component sees the same calls, and of a decision that it opens there the first alternative
    is taken at once.

    A branch is a copy of this process: what any component of the system has in memory is copied,
    and nothing it does can be seen outside, except files that it opens by name during the branch;
    a component that does that cannot be branched.
    """

    @property
    @abc.abstractmethod
    def decision(self) -> Decision | None:
        """The decision that the last step left open; `None` if there is none."""

    @abc.abstractmethod
    def decide(self, alternative: int) -> None:
        """Take an alternative, by its index, and close the decision."""

    @abc.abstractmethod
    def score(self) -> float:
        """How good things went, as known at the last step; the larger, the better.

        Asked for at the horizon, or at the end of the simulation if that comes first, which may
        be another time in each branch; scores are compared between the branches of one decision
        only. Not NaN.
        """

    def score_bound(self, horizon: Time) -> float:
        """What `score` cannot exceed at or before `horizon`, whatever happens until then.

        Asked for while a decision is open, and in its branches until the next one is opened
        there. A branch that can no longer beat the best one before it is left early; that
        changes no choice as long as this is true.

        Args:
            horizon: that of the decision, or the stop time if that comes first [ns].
        """
        return math.inf
