"""Watches how much memory a process has, and says so when it is too much.

What counts is what the process has in memory for itself, as the kernel tells it: neither the code
of libraries, nor values in memory that processes share, nor address space that is only reserved.
A limit of the address space (`RLIMIT_AS`) counts these, 64 MB for each thread among them; a
component that meets it dies of a null pointer, and nobody knows why. Control groups need rights
that a user of a container seldom has.
"""

import os
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Final

PERIOD: Final = 0.02
"""Time between two looks [s]."""


def private_memory(pid: int) -> int:
    """What the process `pid` has in memory for itself [byte]; 0 when it is gone."""
    try:
        fields = Path(f"/proc/{pid}/statm").read_bytes().split()
    except OSError:
        return 0
    return (int(fields[1]) - int(fields[2])) * os.sysconf("SC_PAGE_SIZE")


def watch_memory(
    pid: Callable[[], int], limit: int, has_ended: threading.Event, exceeded: Callable[[int], None]
) -> None:
    """Look at a process, from another thread, until it has ended or has too much memory.

    Args:
        pid: gives the number of the process.
        limit: what it may have [byte].
        has_ended: set when it has.
        exceeded: called once with what it has [byte], if that is more.
    """

    def look() -> None:
        while not has_ended.wait(PERIOD):
            amount = private_memory(pid())
            if amount > limit:
                exceeded(amount)
                return

    threading.Thread(target=look, name="memory", daemon=True).start()
