"""What a step says beyond that it was made: Python makes the rest of it, and the engine goes on."""

import ctypes
from collections.abc import Callable
from typing import Any

from typing_extensions import override

from orchestrator.algorithm.participant import Participant
from orchestrator.algorithm.participants import ConcurrentParticipant
from orchestrator.errors import ComponentError
from orchestrator.native import NativeLink, NativeOwner
from orchestrator.plan import layouts
from orchestrator.signal import Signals
from orchestrator.timebase import Duration, Time


class Attendance:
    """Completes the steps of one unit.

    Args:
        participant: the unit among all.
        owner: its component.
    """

    def __init__(self, participant: Participant, owner: NativeOwner) -> None:
        self._participant = participant
        self._owner = owner
        self._raised: BaseException | None = None
        self._callback = layouts.Attend(self._attend)

    @property
    def address(self) -> Any:
        """What the engine calls; it lives as long as this."""
        return ctypes.cast(self._callback, ctypes.c_void_p)

    @property
    def ending(self) -> int:
        """What the last step asks for, as the engine says it."""
        asking = self._participant.asking
        if asking.request is None:
            return layouts.GOES_ON
        return layouts.ENDS_WITHIN if asking.has_ended else layouts.ENDS_BEHIND

    def publish(self, *, is_reached: bool) -> None:
        """Let what the last step asks for count, if its end is published."""
        if is_reached and self._participant.asking.request is not None:
            self._participant.asking.publish()

    def error(self, t: Time) -> ComponentError | None:
        """The error of a step from `t` [ns] that could not be completed; `None` if there is none.

        Raises:
            BaseException: what was raised meanwhile, if it is no error of the component.
        """
        if isinstance(self._raised, Exception):
            return self._participant.failure(t, self._raised)
        if self._raised is not None:
            raise self._raised
        return None

    def _attend(self, status: int, t: Time) -> int:
        """Make the rest of the step from `t` [ns], whose call returned `status`."""
        h = self._participant.grid.after(t) - t
        try:
            self._complete(status, t, h)
        except BaseException as error:
            self._raised = error
            return layouts.HAS_FAILED
        return self.ending

    def _complete(self, status: int, t: Time, h: Duration) -> None:
        self._owner.complete_step(status, t, h)
        self._participant.asking.is_within(t + h)


class LinkAttendance(Attendance):
    """Waits for the steps of a unit in another process.

    Args:
        participant: the unit among all.
        link: to it.
        adopt: takes outputs, which the engine cannot get.
    """

    def __init__(
        self, participant: ConcurrentParticipant, link: NativeLink, adopt: Callable[[Signals], None]
    ) -> None:
        super().__init__(participant, link)
        self._concurrent = participant
        self._link = link
        self._adopt = adopt

    @override
    def _complete(self, status: int, t: Time, h: Duration) -> None:
        self._link.complete_step(status, t, h)
        self._concurrent.wait_for(t, h)
        if not self._concurrent.asking.has_ended:
            self._adopt(self._concurrent.pending)
