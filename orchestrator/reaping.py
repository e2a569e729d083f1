"""No process outlives the one that is answerable for it, whatever session it has moved to (Linux).

Linux gives a process whose parent has died to the nearest ancestor that asked for it (`prctl(2)`,
`PR_SET_CHILD_SUBREAPER`). Such an ancestor can end all that its descendants ever started: process
groups and sessions do not matter. Elsewhere there is no such thing, and nothing is done.
"""

import ctypes
import os
import signal
import sys
from contextlib import suppress
from pathlib import Path
from time import monotonic, sleep
from typing import Final

_DEATH_SIGNAL: Final = 1  # PR_SET_PDEATHSIG
_SUBREAPER: Final = 36  # PR_SET_CHILD_SUBREAPER

_LONGEST: Final = 5.0
"""How long to wait for processes that were killed; the kernel may hold one up [s]."""


def adopt() -> None:
    """Be the parent of all descendants whose own parent dies."""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_SUBREAPER, 1, 0, 0, 0)


def die_with(parent: int) -> None:
    """Be killed when the thread ends that made this process; at once, if `parent` is gone."""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_DEATH_SIGNAL, signal.SIGKILL, 0, 0, 0)
        if os.getppid() != parent:
            os._exit(1)


def children_of(pid: int) -> list[int]:
    """The children of a process with one thread, oldest first; none where that is not known."""
    with suppress(OSError):
        return [int(each) for each in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]
    return [int(each.name) for each in Path("/proc").glob("[0-9]*") if _parent(each) == pid]


def end_children() -> None:
    """Kill all children of this process, and theirs as it adopts them, until there are none."""
    until = monotonic() + _LONGEST
    while monotonic() < until:
        for child in children_of(os.getpid()):
            with suppress(ProcessLookupError, PermissionError):
                os.kill(child, signal.SIGKILL)
        try:
            ended, _ = os.waitpid(-1, os.WNOHANG)
        except ChildProcessError:
            return
        if not ended:
            sleep(0.002)


def _parent(folder: Path) -> int:
    """The parent of the process that has this folder in /proc; 0 if it is gone."""
    try:
        return int((folder / "stat").read_text().rpartition(")")[2].split()[1])
    except OSError:
        return 0
