"""Scheduled Execution of an FMI 3.0 FMU: its model partitions, each by its clock (section 5)."""

import ctypes
import math
from collections.abc import Callable, Sequence
from ctypes import c_bool, c_char_p, c_double, c_uint32, c_void_p
from typing import Any, Final

import fmpy.fmi3
from typing_extensions import override

from adapters.fmi.clocks import HALF_NANOSECOND, Clocks
from adapters.fmi.errors import FmuError
from adapters.fmi.event_mode import MOST_ITERATIONS, Events
from adapters.fmi.handle import Handle
from adapters.fmi.outcome import MADE, StepOutcome
from adapters.fmi.unpacked import LoadedFmu

_INSTANTIATE: Final = ctypes.CFUNCTYPE(
    c_void_p,
    *(c_char_p, c_char_p, c_char_p, c_bool, c_bool),
    *(c_void_p, fmpy.fmi3.fmi3LogMessageCallback, fmpy.fmi3.fmi3ClockUpdateCallback),
    *(fmpy.fmi3.fmi3LockPreemptionCallback, fmpy.fmi3.fmi3UnlockPreemptionCallback),
)
_ACTIVATE: Final = (c_void_p, c_uint32, c_double)


class Announcements:
    """What the FMU calls while a model partition runs.

    There is one thread, so that no partition interrupts another one, and locks do nothing.

    Attributes:
        listener: is told that clocks changed; set before the first partition runs.
        problem: what went wrong there, which cannot pass through the FMU.
    """

    def __init__(self) -> None:
        self.listener: Callable[[], None] = lambda: None
        self.problem: Exception | None = None
        self._update = fmpy.fmi3.fmi3ClockUpdateCallback(self._on_update)
        self._lock = fmpy.fmi3.fmi3LockPreemptionCallback(lambda: None)
        self._unlock = fmpy.fmi3.fmi3UnlockPreemptionCallback(lambda: None)

    def instantiate(self, fmu: LoadedFmu, named: Sequence[Any], log: Any) -> int | None:
        """Call `fmi3InstantiateScheduledExecution`; the address of the instance, if there is one.

        Args:
            fmu: the library.
            named: name, token, folder of resources, whether it is visible, whether it logs.
            log: the callback for messages.
        """
        function = _INSTANTIATE(fmu.address_of("fmi3InstantiateScheduledExecution"))
        found: int | None = function(*named, None, log, self._update, self._lock, self._unlock)
        return found

    def _on_update(self, _: Any) -> None:
        try:
            self.listener()
        except Exception as error:
            self.problem = self.problem or error


class Schedule(Events):
    """Activates the model partitions of one instance.

    Those of time-based clocks run when these tick, in order of time and then of priority, those of
    triggered clocks at the beginning of the communication step for which they are true.

    Args:
        handle: of the instance.
        clocks: of the instance.
        announcements: of the FMU.
    """

    def __init__(self, handle: Handle, clocks: Clocks, announcements: Announcements) -> None:
        self.announced = math.inf
        self._handle = handle
        self._clocks = clocks
        self._announcements = announcements
        self._now = 0.0
        self._ticking: list[int] = []
        announcements.listener = self._on_update

    @override
    def begin(self, t: float) -> bool:
        self._run_until(t)
        return False

    @override
    def handle(
        self, t: float, change: Callable[[], None] | None = None, clocks: Sequence[int] = ()
    ) -> bool:
        if change is not None:
            change()
        for reference in clocks:
            self._activate(reference, t)
        return False

    @override
    def step(self, t: float, h: float) -> StepOutcome:
        self._run_until(t + h)
        return MADE

    def _run_until(self, stop: float) -> None:
        last, count = -math.inf, 0
        while (time := self._clocks.next_time) <= stop + HALF_NANOSECOND:
            count = count + 1 if time == last else 0
            last = time
            if count > MOST_ITERATIONS:
                raise FmuError(
                    f"{MOST_ITERATIONS} model partitions followed each other at {time} s"
                )
            self._activate(self._clocks.due(time)[0], time)

    def _activate(self, reference: int, t: float) -> None:
        """Run one model partition; what it lets out is got behind it."""
        self._now, self._ticking = t, [reference]
        self._clocks.let_in([reference])
        name = "fmi3ActivateModelPartition"
        status = self._handle.fmu.function(name, _ACTIVATE)(self._handle.address, reference, t)
        problem, self._announcements.problem = self._announcements.problem, None
        if problem is not None:
            raise problem
        self._handle.guard.check(name, status)
        self._clocks.let_out(self._ticking)
        self._clocks.schedule([reference], t)

    def _on_update(self) -> None:
        """Clock update mode: output clocks ticked, or countdowns begin."""
        self._ticking += self._clocks.ticking_outputs()
        self._clocks.ask_countdowns(self._now)
