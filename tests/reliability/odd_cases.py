"""Cases that crash, hang, eat memory or end their process: the campaign has to survive them."""

import os
import signal
import time
from collections.abc import Callable
from pathlib import Path

from tests.reliability.area import Outcome


def performer(seed: int, folder: Path) -> Callable[[int], Outcome]:
    """Of ten cases, four do not come to their end."""
    del seed

    def perform(number: int) -> Outcome:
        if number == 2:
            os.kill(os.getpid(), signal.SIGSEGV)
        if number == 4:
            time.sleep(60)
        if number == 6:
            os._exit(7)
        if number == 8:
            try:
                bytearray(10**9)
            except MemoryError:
                return Outcome(number, "memory", is_expected=False, why="MemoryError")
        (folder / "temporary" / "left").touch()
        return Outcome(number, "fine", is_expected=True)

    perform.kind = lambda number: f"kind {number}"  # type: ignore[attr-defined]
    return perform
