"""Requests to stop wait while something is done that cannot be left halfway."""

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Final

_ALL: Final = ("SIGINT", "SIGTERM", "SIGHUP")


@contextmanager
def deferred() -> Iterator[None]:
    """Let requests to stop wait for the end of the block; the first is heard then.

    Dask's workers, interrupted while they start, are neither there nor gone: to end them fails with
    a traceback, and leaves processes behind. Signals that this process does not handle, and other
    threads, are not concerned.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    heard: list[int] = []

    def note(number: int, frame: FrameType | None) -> None:
        del frame
        heard.append(number)

    numbers = [getattr(signal, name) for name in _ALL if hasattr(signal, name)]
    before = {each: handler for each in numbers if callable(handler := signal.getsignal(each))}
    for each in before:
        signal.signal(each, note)
    try:
        yield
    finally:
        for each, handler in before.items():
            signal.signal(each, handler)
        if heard:  # also after an error, which then may come of the request
            before[heard[0]](heard[0], None)
