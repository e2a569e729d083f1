"""What a process and its children take, as the kernel of Linux tells it."""

import os
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Final

_PROC: Final = Path("/proc")


@dataclass(frozen=True, slots=True, kw_only=True)
class Usage:
    """What some processes take together.

    Attributes:
        memory: for themselves [byte].
        files: that are open.
        processor: time that they have used [s].
    """

    memory: int
    files: int
    processor: float


def family(pid: int) -> list[int]:
    """A process and all that descend from it and are still there."""
    found = [pid]
    for each in found:
        for children in _PROC.glob(f"{each}/task/*/children"):  # each thread has its own
            with suppress(OSError):
                found += map(int, children.read_text().split())
    return found


def usage(pid: int) -> Usage:
    """What a process and all that descend from it take; whoever ends meanwhile takes nothing."""
    memory = files = 0
    processor = 0.0
    for each in family(pid):
        try:
            pages = (_PROC / f"{each}/statm").read_text().split()
            ticks = (_PROC / f"{each}/stat").read_text().rpartition(")")[2].split()[11:13]
            files += sum(1 for _ in (_PROC / f"{each}/fd").iterdir())
        except OSError:
            continue
        memory += (int(pages[1]) - int(pages[2])) * os.sysconf("SC_PAGE_SIZE")
        processor += sum(map(int, ticks)) / os.sysconf("SC_CLK_TCK")
    return Usage(memory=memory, files=files, processor=processor)
