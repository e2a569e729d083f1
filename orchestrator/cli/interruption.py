"""Stopping a run in good order when the user, or the system, asks for it."""

import math
import signal
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from time import monotonic
from types import FrameType

from typing_extensions import override

from orchestrator.cli.requests import SAME_REQUEST, requests
from orchestrator.cli.watch import WATCH
from orchestrator.observer import Observer, SimulationResult
from orchestrator.signal import Signals
from orchestrator.system import System
from orchestrator.timebase import Time


class StopOnRequest(Observer):
    """Ends the run at the first communication point after a request.

    There, every recorded signal is complete. Being the last of the observers, it lets the
    recorder see the communication point first.
    """

    sees_stretches = True

    def __init__(self) -> None:
        self._requested = False
        self._is_running = False
        self._heard_at = -math.inf

    @override
    def begin(self, system: System, start: Time, stop: Time) -> None:
        self._is_running = True

    @override
    def observe(self, t: Time, published: tuple[str, ...], values: Mapping[str, Signals]) -> None:
        self.check()

    @override
    def look_up(self) -> None:
        self.check()

    @override
    def end(self, result: SimulationResult) -> None:
        self._is_running = False

    @property
    def is_requested(self) -> bool:
        """Whether there was a request."""
        return self._requested

    def request(self, number: int, frame: FrameType | None) -> None:
        """Handle a signal: note the first, obey the second at once.

        What comes on the heels of another one is the same request: a program that ends a group of
        processes tells each, and those that wait for others hand it on.
        """
        del number, frame
        before, self._heard_at = self._heard_at, monotonic()
        if self._heard_at - before < SAME_REQUEST:
            return
        is_first, self._requested = not self._requested, True
        if not (is_first and self._is_running):
            raise KeyboardInterrupt
        with suppress(OSError):  # the terminal may be gone
            sys.stderr.write("\nstopping at the next communication point; again to stop at once\n")

    def check(self) -> None:
        """Raise `KeyboardInterrupt` if there was a request.

        What `request` raises in a destructor is lost (Python documentation, `object.__del__`);
        Dask's futures have one that takes its time. Long loops call this.
        """
        if self._requested:
            raise KeyboardInterrupt


@contextmanager
def stopping() -> Iterator[StopOnRequest]:
    """While the block runs, Ctrl-C, SIGTERM and SIGHUP are requests to stop."""
    observer = StopOnRequest()
    before = {number: signal.signal(number, observer.request) for number in requests()}
    try:
        yield observer
    finally:
        # whoever waits for this process may hand on a request that is obeyed already
        is_over = WATCH.is_told and observer.is_requested
        for number, handler in before.items():
            signal.signal(number, signal.SIG_IGN if is_over else handler)
