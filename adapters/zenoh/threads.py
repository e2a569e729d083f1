"""Threads of Zenoh's own that call us back."""

import ctypes
import sys
import threading
from typing import Final


class _Known(threading.local):
    """Whether the thread that looks is one of those that stay known."""

    yes = False


_KNOWN: Final = _Known()


def stay_known() -> None:
    """Let CPython know the thread that calls this, one that it has not started, from now on.

    Otherwise it makes a state for the thread before each callback and drops it afterwards: memory
    is mapped, touched and given back, which takes longer than to pass a small reply on.
    """
    if not _KNOWN.yes:
        _KNOWN.yes = True
        if sys.implementation.name == "cpython":
            # one more than is released when the callback ends; the lock is released all the same
            ctypes.pythonapi.PyGILState_Ensure()
