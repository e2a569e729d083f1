"""The time of an FMU for Model Exchange: the solver goes from event to event."""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from adapters.fmi.errors import FmuError
from adapters.fmi.model_exchange.equation import Equation
from adapters.fmi.model_exchange.functions import CompletedStep, ContinuousFunctions
from adapters.fmi.model_exchange.solver import Solver
from orchestrator.signal import Array

_ULPS: Final = 4
"""Points of time that are so close are one: sums of decimal fractions."""
_SHORTEST: Final = 1e-15
"""No time passes in less than this [s]; communication points are whole nanoseconds."""
_UPDATES: Final = 1000
"""After so many updates at one event, its iteration is taken to be endless."""
_STUCK: Final = 1000
"""After so many events between which time does not go on, they are taken to be endless."""


_NOTHING: Final = CompletedStep(is_event=False, is_over=False)


def are_one(a: float, b: float) -> bool:
    """Whether two points of time [s] differ by nothing but rounding."""
    return abs(a - b) <= max(_ULPS * math.ulp(max(abs(a), abs(b))), _SHORTEST)


def usable(nominals: Array) -> Array:
    """Nominal values of which only the size counts, and 1 in the place of 0.

    Args:
        nominals: as an FMU says them, shape (state,).

    Returns:
        Positive, shape (state,).
    """
    sizes = np.abs(nominals)
    return np.where(sizes == 0.0, 1.0, sizes)


@dataclass(frozen=True, slots=True, kw_only=True)
class Moment:
    """Where an integration is.

    Attributes:
        now: the time of the FMU [s].
        next_event: its next time event [s]; `None` if it does not know of one.
    """

    now: float
    next_event: float | None


class Integration:
    """One instance in continuous-time mode, between two calls.

    Args:
        functions: of the instance.
        equation: of the instance.
        solver: for it; `None` if nothing depends on time but events at known times.
        count: number of continuous states.
        hears_steps: whether the FMU has to hear of completed steps.
        keeps_state: whether no earlier state will be returned to.
    """

    def __init__(
        self,
        functions: ContinuousFunctions,
        equation: Equation,
        solver: Solver | None,
        *,
        count: int,
        hears_steps: bool,
        keeps_state: bool,
    ) -> None:
        self._functions, self._equation, self._solver = functions, equation, solver
        self._count = count
        self._hears_steps, self._keeps_state = hears_steps, keeps_state
        self._now = 0.0
        self._next_event: float | None = None
        self._is_fresh = False
        self._stuck = 0
        self._last_event = -math.inf

    @property
    def moment(self) -> Moment:
        """Where it is now."""
        return Moment(now=self._now, next_event=self._next_event)

    @property
    def equation(self) -> Equation:
        """What is integrated."""
        return self._equation

    def begin(self, t: float) -> bool:
        """Take over an FMU that has just been initialised at `t` [s], in event mode.

        Returns:
            Whether the FMU asks to end the simulation.
        """
        self._now = t
        return self._settle()

    def resume(self, moment: Moment) -> None:
        """Take over an FMU that was returned to a state of that moment."""
        self._now, self._next_event = moment.now, moment.next_event
        self._is_fresh = False

    def enter_event_mode(self) -> None:
        """Let discrete inputs be set; `leave_event_mode` ends that."""
        self._functions.enter_event_mode()

    def leave_event_mode(self) -> bool:
        """Update discrete states until nothing changes, and go on in continuous time.

        Returns:
            Whether the FMU asks to end the simulation.
        """
        return self._settle()

    def rates(self) -> Array:
        """The derivatives of the states here, float64, shape (state,)."""
        found = np.zeros(self._count)
        if self._count and not self._functions.get_rates(found.ctypes.data, self._count):
            raise FmuError(f"the FMU does not know its derivatives at {self._now:.9g} s (Discard)")
        return found

    def advance(self, start: float, stop: float) -> bool:
        """Go on from the communication point `start` to `stop` [s].

        If earlier states may be returned to, the solver begins without a memory of the steps
        before, so that a step that is repeated gives the same bits.

        Args:
            start: where the last one has ended [s].
            stop: behind it [s].

        Returns:
            Whether the FMU asks to end the simulation; `moment` is when.

        Raises:
            FmuError: the FMU or the solver failed, or events do not end.
        """
        self._now = max(self._now, start)
        self._is_fresh = self._is_fresh and self._keeps_state
        self._stuck = 0
        while True:
            target = self._target(stop)
            said = self._integrate(target)
            if said.is_over:
                return True
            is_due = self._next_event is not None and self._now >= self._next_event
            if said.is_event or is_due:
                self._functions.enter_event_mode()
                if self._settle():
                    return True
                self._count_events()
            elif self._now >= stop or are_one(self._now, stop):
                return False

    def _target(self, stop: float) -> float:
        event = self._next_event
        is_before = event is not None and (event < stop or are_one(event, stop))
        return max(event, self._now) if is_before and event is not None else max(stop, self._now)

    def _integrate(self, target: float) -> CompletedStep:
        """Go on to `target` [s], or to a state or step event before it, or an end."""
        if are_one(self._now, target):
            self._move(target)
            return _NOTHING
        if self._solver is None:
            self._move(target)
            return self._complete()
        if not self._is_fresh:
            self._restart(self._solver)
        while self._now < target:
            reached = self._solver.advance(target)
            self._move(reached.t)
            said = self._complete()
            if reached.is_event or said is not _NOTHING:
                return CompletedStep(
                    is_event=reached.is_event or said.is_event, is_over=said.is_over
                )
        return _NOTHING

    def _restart(self, solver: Solver) -> None:
        states, nominals = np.ones(1), np.ones(1)
        if self._count:
            states = self._functions.states(self._count)
            nominals = usable(self._functions.nominals(self._count))
        solver.restart(self._now, states, nominals)
        self._is_fresh = True

    def _move(self, t: float) -> None:
        """Take the FMU to `t` [s] and to what the solver reached there."""
        self._now = t
        is_held = self._solver is None or not self._is_fresh
        states = self._functions.states(self._count) if is_held else None
        if states is None and self._solver is not None:
            states = self._solver.states
        address = 0 if states is None else states.ctypes.data
        if not self._equation.move(t, address):
            raise FmuError(f"the FMU cannot go to {t:.9g} s (Discard)")

    def _complete(self) -> CompletedStep:
        """Tell the FMU that a step is complete, and hear what follows."""
        if not self._hears_steps:
            return _NOTHING
        said = self._functions.complete_step(keeps_state=self._keeps_state)
        return said if said.is_event or said.is_over else _NOTHING

    def _settle(self) -> bool:
        """Update discrete states until nothing changes, and enter continuous-time mode.

        Returns:
            Whether the FMU asks to end the simulation; it stays in event mode then.
        """
        for _ in range(_UPDATES):
            update = self._functions.update()
            if update.is_over:
                return True
            if not update.is_incomplete:
                break
        else:
            what = f"after {_UPDATES} updates, discrete states still change"
            raise FmuError(f"the event at {self._now:.9g} s does not end: {what}")
        self._next_event = update.next_event
        self._functions.enter_continuous_time_mode()
        self._is_fresh = False
        return False

    def _count_events(self) -> None:
        is_stuck = are_one(self._now, self._last_event)
        self._stuck = self._stuck + 1 if is_stuck else 0
        self._last_event = self._now
        if self._stuck >= _STUCK:
            raise FmuError(
                f"events at {self._now:.9g} s do not end: {_STUCK} without any time between"
            )

    def free(self) -> None:
        """Free the solver."""
        if self._solver is not None:
            self._solver.free()
