"""Event mode of an FMI 3.0 co-simulation FMU (FMI 3.0.2, sections 2.3.5 and 4.2.1)."""

import abc
import ctypes
import math
from collections.abc import Callable, Sequence
from ctypes import c_bool, c_double
from typing import Final, TypeAlias

from typing_extensions import override

from adapters.fmi.clocks import HALF_NANOSECOND, Clocks
from adapters.fmi.errors import FmuError
from adapters.fmi.handle import Handle
from adapters.fmi.outcome import StepOutcome

DoStep: TypeAlias = Callable[[float, float], StepOutcome]
"""Calls `fmi3DoStep` from a time over a length [s]."""

MOST_ITERATIONS: Final = 1000
"""Updates of the discrete states at one point in time, and events without any progress."""


class Events(abc.ABC):
    """What happens in one instance besides the passing of time.

    Attributes:
        announced: the time of the next event that the FMU told [s]; infinite if there is none.
    """

    announced: float

    @abc.abstractmethod
    def begin(self, t: float) -> bool:
        """Handle the events at the end of initialisation mode, at `t` [s]; see `handle`."""

    @abc.abstractmethod
    def handle(
        self, t: float, change: Callable[[], None] | None = None, clocks: Sequence[int] = ()
    ) -> bool:
        """Handle the events at `t` [s].

        Args:
            t: the current time of the FMU [s].
            change: sets inputs that jump there.
            clocks: input clocks that are triggered there, by priority.

        Returns:
            Whether the FMU asks to end the simulation.
        """

    @abc.abstractmethod
    def step(self, t: float, h: float) -> StepOutcome:
        """Step from `t` over `h` [s], or to the first event before that, which is handled."""


class EventMode(Events):
    """Handles the events of one instance: those it finds, those it announces, those of inputs.

    Args:
        handle: of the instance.
        do_step: in step mode.
        clocks: of the instance.
        may_vary: whether its steps may differ in length, so that one may end at an event.

    Attributes:
        announced: the time of the next event that the FMU told [s]; infinite if there is none.
    """

    def __init__(self, handle: Handle, do_step: DoStep, clocks: Clocks, *, may_vary: bool) -> None:
        self._handle = handle
        self._do_step = do_step
        self._clocks = clocks
        self._may_vary = may_vary
        self.announced = math.inf

    @property
    def next_time(self) -> float:
        """The next event that is known, a tick of a clock or another one [s]."""
        return min(self.announced, self._clocks.next_time)

    @override
    def begin(self, t: float) -> bool:
        wants_end = self._settle(t)
        self._handle.call("fmi3EnterStepMode")
        return wants_end

    @override
    def handle(
        self, t: float, change: Callable[[], None] | None = None, clocks: Sequence[int] = ()
    ) -> bool:
        self._handle.call("fmi3EnterEventMode")
        if change is not None:
            change()
        wants_end = self._settle(t, clocks)
        self._handle.call("fmi3EnterStepMode")
        return wants_end

    @override
    def step(self, t: float, h: float) -> StepOutcome:
        for _ in range(MOST_ITERATIONS):
            stop = self._cut(t, t + h)
            outcome = self._do_step(t, stop - t if stop != t + h else h)
            if outcome.is_discarded:
                return outcome
            reached = stop if outcome.time is None else outcome.time
            wants_end = outcome.wants_end
            if not wants_end and (outcome.needs_event or reached >= self.next_time):
                wants_end = self.handle(reached)
            if wants_end or reached > t:
                is_early = outcome.is_early and not outcome.needs_event
                return StepOutcome(time=reached, is_early=is_early, wants_end=wants_end)
        raise FmuError(f"{MOST_ITERATIONS} events followed each other at {t:.9g} s")

    def _cut(self, t: float, stop: float) -> float:
        """Where a step to `stop` has to end: at the next event, also if that is all but there."""
        is_within = t < self.next_time < stop + HALF_NANOSECOND
        return self.next_time if self._may_vary and is_within else stop

    def _settle(self, t: float, triggered: Sequence[int] = ()) -> bool:
        """Let clocks tick and update discrete states until there is nothing left to do at `t`."""
        again, wants_end, nominals, values, is_defined = (c_bool() for _ in range(5))
        time = c_double()
        flags = (again, wants_end, nominals, values, is_defined)
        results = [*(ctypes.byref(flag) for flag in flags), ctypes.byref(time)]
        clocks = self._clocks
        ticking = [*clocks.due(t), *triggered]
        for _ in range(MOST_ITERATIONS):
            clocks.activate(ticking)
            clocks.let_out([*ticking, *clocks.ticking_outputs()])
            self._handle.call("fmi3UpdateDiscreteStates", *results)
            self.announced = time.value if is_defined.value else math.inf
            clocks.schedule(ticking, t)
            clocks.ask_countdowns(t)
            ticking = clocks.due(t)
            if wants_end.value or not (again.value or ticking):
                return wants_end.value
        raise FmuError(
            f"the discrete states at {t:.9g} s do not settle: there is more to do after "
            f"{MOST_ITERATIONS} calls of fmi3UpdateDiscreteStates"
        )
