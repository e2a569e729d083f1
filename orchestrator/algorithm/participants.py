"""Where a participant steps: in the calling thread, or elsewhere."""

from collections.abc import Mapping
from contextlib import nullcontext, suppress
from time import perf_counter_ns

from typing_extensions import override

from orchestrator.algorithm.participant import Participant, Participants
from orchestrator.component import Component, ConcurrentComponent
from orchestrator.errors import ComponentError, defects
from orchestrator.native import NativeUnit
from orchestrator.signal import Connector, Signals
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
        except defects() as error:
            raise self.failure(t, error) from error

    @override
    def begin_early(self, t: Time) -> None:
        pass

    @override
    def begin_ahead(self, t: Time) -> None:
        pass

    @override
    def foresee(self, now: Time) -> None:
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
        "_begun_at", "_concurrent", "_failed", "_is_ahead", "_is_stepping", "_read_until",
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
        self._read_until: tuple[tuple[Participant, Duration], ...] | None = None
        self._begun_at: Time = 0
        self._is_ahead = False
        self._is_stepping = False

    @override
    def take_turns(self, leaders: Participants, followers: Participants) -> None:
        # of those in front what is published where the step ends, of the others what is before
        self._read_until = (*((each, 0) for each in leaders), *((each, 1) for each in followers))

    @override
    def native(self) -> NativeUnit | None:
        return self._component.native()

    def go_on_waiting(self, published: Signals, t: Time, h: Duration, spent_ns: int) -> None:
        """`go_on` in the middle of a step from `t` [ns] over `h` [ns], begun here or not."""
        self.published.update(published)
        self.wall_time_ns += spent_ns
        self._be_begun(t, h)

    def wait_for(self, t: Time, h: Duration) -> None:
        """Wait for a step from `t` [ns] over `h` [ns] that was begun, here or not.

        Its outputs are pending then. Whoever calls this counts the time.

        Raises:
            ComponentError: the component failed, or broke its contract.
        """
        spent = self.wall_time_ns
        self._be_begun(t, h)
        self._complete()
        self.wall_time_ns = spent

    def _be_begun(self, t: Time, h: Duration) -> None:
        """Know of a step that was begun, if it was not here."""
        if not self.is_begun:
            self.is_begun = self._is_stepping = True
            # by turns it is no matter of the run before its turn has come
            self._is_ahead = self._read_until is not None
            self._begun_at, self._reached = t, t + h

    @override
    def begin(self, t: Time, h: Duration | None = None) -> None:
        self._begin(t, h)

    def _begin(
        self, t: Time, h: Duration | None = None, unpublished: Mapping[str, Signals] | None = None
    ) -> None:
        self._begun_at = t
        before = perf_counter_ns()
        try:
            if self._is_whole:
                inputs, length = self._read(t, h, unpublished)
                self._concurrent.begin_step(inputs, t, length)
                self._is_stepping = True
            else:
                self._is_stepping = self._begin_pieces(t, h, unpublished)
        except defects() as error:
            raise self.failure(t, error) from error
        self.is_begun, self._is_ahead = True, False
        self.wall_time_ns += perf_counter_ns() - before

    def _begin_pieces(
        self, t: Time, h: Duration | None, unpublished: Mapping[str, Signals] | None
    ) -> bool:
        """Take all pieces but the last, and begin that; `False` if it ended before that."""
        *whole, last = self._begun(t, h, unpublished)
        for piece in whole:
            self._follow(piece)
            self._concurrent.step(piece.inputs, piece.t, piece.h)
            if self.asking.is_within(piece.t + piece.h):
                return False
        self._follow(last)
        self._concurrent.begin_step(last.inputs, last.t, last.h)
        return True

    @override
    def finish(self) -> None:
        self._complete()
        self.asking.check()

    def _complete(self) -> None:
        self.is_begun = False
        if self._failed is not None:
            failed, self._failed = self._failed, None
            raise failed
        if self._is_stepping:
            self._wait()

    def _wait(self) -> None:
        """Wait for the step; its outputs are `pending` then."""
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
        except defects() as error:
            raise self.failure(self._begun_at, error) from error

    @override
    def begin_early(self, t: Time) -> None:
        if not self.is_begun:
            self._begin_early(t)

    def _begin_early(self, t: Time, unpublished: Mapping[str, Signals] | None = None) -> None:
        try:
            self._begin(t, None, unpublished)
        except ComponentError as error:
            self._failed, self.is_begun = error, True
        self._is_ahead = True

    @override
    def begin_ahead(self, t: Time) -> None:
        if not self.is_begun and (not self.sources or self._unpublished(t, t) == {}):
            self._begin_early(t)

    @override
    def foresee(self, now: Time) -> None:
        if self._is_stepping:
            self._hear()
        elif not self.is_begun:
            unpublished = self._unpublished(self._reached, now)
            if unpublished is not None:
                self._begin_early(self._reached, unpublished)

    def _hear(self) -> None:
        """Have the outputs of the step ready for its turn, if it is done."""
        if self._concurrent.has_finished():
            try:
                self._wait()
            except ComponentError as error:
                self._failed = error

    def _unpublished(self, t: Time, now: Time) -> dict[str, Signals] | None:
        """What of that which the step from `t` reads is still to be published at `now`.

        By component; `None` if that is not known.
        """
        # inputs may be made at the time of the step, such as late ones
        if self._read_until is None or self.inputs.mixed or self._pieces is not None:
            return None
        end, found = self._grid.after(t), {}
        for each, before in self._read_until:
            values = each.foreseen(now, end - before)
            if values is None:
                return None
            if values:
                found[each.name] = values
        return found

    @override
    def foreseen(self, now: Time, end: Time) -> Signals | None:
        following = self._grid.after(now)
        if following > end:
            return {}
        is_known = self.is_begun and not self._is_stepping and self._failed is None
        is_last = self._reached == following and self._grid.after(following) > end
        return self._pending if is_known and is_last and not self.asking.has_ended else None

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
