"""The end of a process in which threads of libraries call Python.

When Python ends, it ends every thread that wants to call it then, by unwinding the thread's stack.
A thread of a library in Rust or C++ takes that for a fault and aborts the process ("FATAL:
exception not rethrown", exit code -6), which has said by then that all is well. CPython lets such
threads hang from 3.14 on (gh-87135). Before, a process that has such a library is ended after all
that is to be done at its end, and before Python is taken apart.
"""

import atexit
import os
import sys
from contextlib import suppress

_is_called = False
_code: int | None = None


def prepare() -> None:
    """See to the end of this process; called first, so that what others register is done before."""
    atexit.register(_leave)


def called_from_outside() -> None:
    """Note that threads which Python has not started may call it, to the end of the process."""
    global _is_called  # noqa: PLW0603 - a process has one end
    _is_called = True


def ends_with(code: int) -> int:
    """Note the exit code of the process, which is about to end; returns it."""
    global _code  # noqa: PLW0603 - as above
    _code = code
    return code


def _leave() -> None:
    if not _is_called or _code is None:
        return
    for stream in (sys.stdout, sys.stderr):
        with suppress(OSError, ValueError, AttributeError):  # full, closed, or none
            stream.flush()
    os._exit(_code)
