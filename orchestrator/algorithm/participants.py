"""Where a participant steps: in the calling thread, or elsewhere."""

from collections.abc import Mapping
from contextlib import nullcontext, suppress
from time import perf_counter_ns

from typing_extensions import override

from orchestrator.algorithm.participant import Participant, Participants
from orchestrator.component import Component, ConcurrentComponent
from orchestrator.errors import ComponentError
from orchestrator.native import NativeUnit
from orchestrator.signal import Connector
from orchestrator.timebase import Duration, StepSize, Time


class LocalParticipant(Participant):
    """A component that steps in the calling thread: `begin` does all the work."""

    __slots__ = ()

    is_concurrent = False

    @override
    def native(self) -> NativeUnit | None:
        return self._component.native()

    @override
    def begin(self, t: Time, h: Duration | None = None) -> None:
        before = self.notes.step(t)
        try:
            for piece in self._begun(t, h):
                self._follow(piece)
                self._component.step(piece.inputs, piece.t, piece.h)
                if self.asking.is_within(piece.t + piece.h):
                    self.wall_time_ns += perf_counter_ns() - before
                    return
            outputs = self._outputs()
            self.wall_time_ns += perf_counter_ns() - before
            self.accept(outputs, t)
        except Exception as error:
            raise self.failure(t, error) from error

    @override
    def begin_ahead(self, t: Time) -> None:
        pass

    @override
    def finish(self) -> None:
        self.asking.check()

    @override
    def settle(self) -> None:
        pass


class ConcurrentParticipant(Participant):
    """A component that steps elsewhere between `begin` and `finish`."""

    __slots__ = (
        "_begun_at", "_concurrent", "_failed", "_followers", "_is_ahead", "_is_stepping",
        "_leaders",
    )  # fmt: skip

    is_concurrent = True

    def __init__(
        self,
        name: str,
        component: ConcurrentComponent,
        connectors: Mapping[str, Connector],
        step_size: StepSize,
    ) -> None:
        super().__init__(name, component, connectors, step_size)
        self._concurrent = component
        self._failed: ComponentError | None = None
        self._leaders: Participants | None = None
        self._followers: Participants = ()
        self._begun_at: Time = 0
        self._is_ahead = False
        self._is_stepping = False

    @override
    def take_turns(self, leaders: Participants, followers: Participants) -> None:
        self._leaders, self._followers = leaders, followers

    @override
    def begin(self, t: Time, h: Duration | None = None) -> None:
        self._begun_at = t
        before = perf_counter_ns()
        try:
            *whole, last = self._begun(t, h)
            for piece in whole:
                self._follow(piece)
                self._concurrent.step(piece.inputs, piece.t, piece.h)
                if self.asking.is_within(piece.t + piece.h):
                    break
            else:
                self._follow(last)
                self._concurrent.begin_step(last.inputs, last.t, last.h)
                self._is_stepping = True
        except Exception as error:
            raise self.failure(t, error) from error
        self.is_begun, self._is_ahead = True, False
        self.wall_time_ns += perf_counter_ns() - before

    @override
    def finish(self) -> None:
        self._complete()
        self.asking.check()

    def _complete(self) -> None:
        self.is_begun = False
        if self._failed is not None:
            failed, self._failed = self._failed, None
            raise failed
        if not self._is_stepping:
            return
        self._is_stepping = False
        before = perf_counter_ns()
        try:
            self._concurrent.finish_step()
            if self.asking.is_within(self._reached):
                self.wall_time_ns += perf_counter_ns() - before
                return
            outputs = self._outputs()
            self.wall_time_ns += perf_counter_ns() - before
            self.accept(outputs, self._begun_at)
        except Exception as error:
            raise self.failure(self._begun_at, error) from error

    @override
    def begin_ahead(self, t: Time) -> None:
        if self._sees_all(t):
            try:
                self.begin(t)
            except ComponentError as error:
                self._failed, self.is_begun = error, True
            self._is_ahead = True

    def _sees_all(self, t: Time) -> bool:
        """Whether all that the step from `t` reads when its turn comes is published at `t`."""
        if not self.sources:
            return True
        # inputs may be made at the time of the step, such as late ones
        if self._leaders is None or self.inputs.mixed or self._pieces is not None:
            return False
        end = self.grid.after(t)
        return all(each.grid.after(t) > end for each in self._leaders) and all(
            each.grid.after(t) >= end for each in self._followers
        )

    @override
    def settle(self) -> None:
        if self.is_begun:
            with suppress(ComponentError) if self._is_ahead else nullcontext():
                self._complete()


def participant(
    name: str, component: Component, connectors: Mapping[str, Connector], step_size: StepSize
) -> Participant:
    """The participant that suits the capabilities of `component`."""
    if isinstance(component, ConcurrentComponent):
        return ConcurrentParticipant(name, component, connectors, step_size)
    return LocalParticipant(name, component, connectors, step_size)
