"""A process beside each host, which ends what the host leaves behind (Linux).

It is the parent of the host and of all that the host starts, also of what has a session of its own.
When the host ends, or the orchestrator, it ends all of them; a host that holds Python's interpreter
lock cannot do that itself. It is a copy of the host from before anything was loaded, does nothing
but wait, and ends as the host did.
"""

import os
import select
import signal
import sys
from typing import Final

from orchestrator.reaping import adopt, die_with, end_children

_OWN: Final = 3
"""The first descriptor that is neither input nor output."""


def guarded(lifeline: int) -> None:
    """Go on in a copy of this process; this one waits for its end, or that of `lifeline`.

    Args:
        lifeline: a pipe whose other end the parent of this process has open; below 3. It is not
            read from here.
    """
    if sys.platform != "linux":
        return
    adopt()
    here = os.getpid()
    host = os.fork()
    if host == 0:
        die_with(here)
        return
    nothing = os.open(os.devnull, os.O_RDWR)
    for output in (1, 2):
        os.dup2(nothing, output)
    os.closerange(_OWN, os.sysconf("SC_OPEN_MAX"))  # whoever reads them waits for the host only
    status = _status_of(host, lifeline)
    end_children()
    if status is None:
        os._exit(1)
    _end_as(status)


def _status_of(host: int, lifeline: int) -> int | None:
    """Wait for the host; its status, or `None` if the lifeline ended before."""
    reading, writing = os.pipe()
    os.set_blocking(reading, False)
    os.set_blocking(writing, False)
    signal.signal(signal.SIGCHLD, lambda number, frame: None)
    signal.set_wakeup_fd(writing, warn_on_full_buffer=False)
    poll = select.poll()
    poll.register(lifeline, 0)
    poll.register(reading, select.POLLIN)
    while True:
        while True:
            ended, status = os.waitpid(-1, os.WNOHANG)  # adopted ones, too
            if ended == host:
                return status
            if not ended:
                break
        for descriptor, _ in poll.poll():
            if descriptor == lifeline:
                return None
            os.read(reading, 4096)


def _end_as(status: int) -> None:
    """End this process with the status of another one."""
    if os.WIFSIGNALED(status):
        number = os.WTERMSIG(status)
        _leave_no_core()
        if number != signal.SIGKILL:
            signal.signal(number, signal.SIG_DFL)
        os.kill(os.getpid(), number)
    os._exit(os.waitstatus_to_exitcode(status))


def _leave_no_core() -> None:
    import resource  # noqa: PLC0415 - not on every system

    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
