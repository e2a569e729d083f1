"""A communication step of an FMU: in one call where that does, else in as many as it takes."""

import math
from dataclasses import dataclass
from typing import NoReturn

from adapters.fmi.errors import FmuError
from adapters.fmi.instance import FmuInstance
from adapters.fmi.messages import MessageLog
from adapters.fmi.outcome import MADE, StepOutcome
from orchestrator.capabilities import EndRequest
from orchestrator.timebase import NANOSECONDS_PER_SECOND, Time


@dataclass(slots=True)
class Pauses:
    """How often a step was not made in one call.

    Attributes:
        early: calls that returned early; the next one went on from there.
        discarded: calls that were discarded, and went on from where the FMU had come.
        retried: calls that were discarded, and were made again, shorter, from the state before.
        shortest: of the calls that went well in spite of it [s]; infinite if there was none.
    """

    early: int = 0
    discarded: int = 0
    retried: int = 0
    shortest: float = math.inf

    @property
    def losses(self) -> str:
        """What was discarded, as a remark; empty if nothing was."""
        parts = [
            *([f"{self.retried} tried again, shorter"] if self.retried else []),
            *([f"{self.discarded} continued from where they had come"] if self.discarded else []),
        ]
        if not parts:
            return ""
        count = self.retried + self.discarded
        shortest = "" if math.isinf(self.shortest) else f"; the shortest took {self.shortest:.3g} s"
        return f"discarded {_calls(count)} of its step: {', '.join(parts)}{shortest}"


class Stepper:
    """Takes communication steps.

    An FMU that stopped within a step, and says how far it came, goes on from there, if its steps
    may differ in length. With `smallest` its state is kept before each call, and a step that it
    discards is made again from there by shorter calls: as far as the FMU said it would come, then
    half as long each time. Each call that goes well is followed by one of twice its length.

    Args:
        log: of the FMU.
        asking: how the FMU asks for the end of the simulation, for messages.
        may_vary: whether it takes steps of different lengths.
        smallest: the shortest call [s] that a discarded step is tried with; `None`: no state is
            kept.
        hint: what would let discarded steps be tried again; empty if nothing would.

    Attributes:
        pauses: what was not made in one call so far.
    """

    def __init__(
        self,
        log: MessageLog,
        *,
        asking: str,
        may_vary: bool,
        smallest: float | None = None,
        hint: str = "",
    ) -> None:
        self._log = log
        self._asking = asking
        self._may_vary = may_vary
        self._smallest = smallest
        self._hint = hint
        self.pauses = Pauses()

    @property
    def keeps_states(self) -> bool:
        """Whether the state of the FMU is kept before each call."""
        return self._smallest is not None

    def account(self) -> None:
        """Say in the log what was not made in one call, and begin to count anew."""
        if self.pauses.losses:
            self._log.warn(self.pauses.losses)
        if self.pauses.early:
            self._log.note(f"returned early from {_calls(self.pauses.early)} of its step")
        self.pauses = Pauses()

    def make(
        self, instance: FmuInstance, begin: float, length: float, end: Time
    ) -> EndRequest | None:
        """Let the FMU take a communication step.

        Args:
            instance: of the FMU.
            begin: where the step begins [s].
            length: of the step [s].
            end: where it ends [ns].

        Returns:
            What it asks for, if it wants the simulation to end.

        Raises:
            FmuError: the step failed, or was discarded for good.
        """
        if self._smallest is not None:
            return self._carefully(instance, begin, length, end, self._smallest)
        outcome = instance.step(begin, length)
        return None if outcome is MADE else self.go_on(instance, outcome, begin, length, end)

    def go_on(
        self, instance: FmuInstance, outcome: StepOutcome, begin: float, length: float, end: Time
    ) -> EndRequest | None:
        """Complete a step whose first call came to `outcome`; otherwise as `make`."""
        limit = begin + length
        while True:
            reached = limit if outcome.time is None else outcome.time
            if outcome.wants_end:
                return self._request(reached, end)
            if _nanoseconds(reached) >= end:
                return None
            if not self._may_vary or reached <= begin:
                _refuse(instance, outcome, begin, self._hint)
            self.pauses.early += outcome.is_early
            self.pauses.discarded += outcome.is_discarded
            self._note(reached - begin)
            self._note(limit - reached)
            begin = reached
            outcome = instance.step(begin, limit - begin)

    def _carefully(
        self, instance: FmuInstance, begin: float, length: float, end: Time, smallest: float
    ) -> EndRequest | None:
        """Do as `make`, with the state before each call at hand."""
        limit = begin + length
        is_first, is_whole = True, True  # of the calls from `begin`; no call has failed
        state = instance.save()
        try:
            while True:
                outcome = instance.step(begin, length)
                reached = begin + length if outcome.time is None else outcome.time
                if outcome.wants_end:
                    return self._request(reached, end)
                if outcome.is_discarded and reached < begin + length:
                    is_ahead = is_first and reached - begin >= smallest
                    shorter = reached - begin if is_ahead else length / 2
                    if shorter < smallest:
                        hint = f"; it does so in calls of {length:.3g} s (`fmi.smallest_step`)"
                        _refuse(instance, outcome, begin, hint)
                    self.pauses.retried += 1
                    length, is_first, is_whole = shorter, False, False
                    instance.restore(state, None)
                    continue
                if not is_whole or outcome.is_early:
                    self._note(reached - begin)
                if _nanoseconds(reached) >= end:
                    return None
                if reached <= begin:
                    _refuse(instance, outcome, begin)
                self.pauses.early += outcome.is_early
                begin, length, is_first = reached, min(2 * length, limit - reached), True
                instance.forget(state)
                state = instance.save()
        finally:
            instance.forget(state)

    def request(self, time: Time) -> EndRequest:
        """What the FMU asks for that wants the simulation to end at `time` [ns]."""
        return EndRequest(time=time, why=self._asking)

    def _request(self, reached: float, end: Time) -> EndRequest:
        return self.request(min(_nanoseconds(reached), end))

    def _note(self, length: float) -> None:
        self.pauses.shortest = min(self.pauses.shortest, length)


def _refuse(instance: FmuInstance, outcome: StepOutcome, begin: float, hint: str = "") -> NoReturn:
    """Raise that an FMU does not get any further from `begin` [s]."""
    reached = begin if outcome.time is None else outcome.time
    if outcome.is_discarded:
        instance.discarded(reached, hint)
    if reached <= begin:
        raise FmuError(f"fmi3DoStep returned early at {reached:.9g} s, where it had begun")
    raise FmuError(
        f"fmi3DoStep returned early at {reached:.9g} s, and its steps must not differ in length "
        "(`canHandleVariableCommunicationStepSize`)"
    )


def _calls(count: int) -> str:
    return "1 call" if count == 1 else f"{count} calls"


def _nanoseconds(time: float) -> Time:
    return round(time * NANOSECONDS_PER_SECOND)
