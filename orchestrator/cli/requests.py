"""Requests to stop, by signals, outside of what can be stopped in good order.

Ctrl-C, SIGTERM and SIGHUP mean the same: the command ends, with exit code 4 and without a
traceback. Who ignores one of them, as `nohup` does, goes on doing so.
"""

import os
import signal
import sys
from collections.abc import Callable
from time import monotonic
from types import FrameType
from typing import Final, TypeAlias

Handler: TypeAlias = Callable[[int, FrameType | None], None]

SAME_REQUEST: Final = 0.1
"""Requests that follow each other faster than this are one [s]."""

_INTERRUPTED: Final = 4
_ALL: Final = ("SIGINT", "SIGTERM", "SIGHUP")
_JSON: Final = '{"error": {"kind": "interrupted", "exit_code": 4, "message": "interrupted"}}\n'


def requests() -> tuple[signal.Signals, ...]:
    """The signals that are requests to stop, but for those that this process ignores."""
    found = (getattr(signal, name) for name in _ALL if hasattr(signal, name))
    return tuple(number for number in found if signal.getsignal(number) is not signal.SIG_IGN)


def handled_by(handler: Handler | int) -> None:
    """Let `handler` have all requests."""
    for number in requests():
        signal.signal(number, handler)


def heard_at_once(*, is_json: bool) -> None:
    """Until a command runs, let a request end the process; nothing is there to be put in order.

    An exception would not do: it can be lost in whatever is imported, or come out of it as
    another one.
    """

    def leave(number: int, frame: FrameType | None) -> None:
        del number, frame
        if is_json:
            os.write(1, _JSON.encode())
        os.write(2, b"interrupted\n")
        os._exit(_INTERRUPTED)

    handled_by(leave)


def heard_by_exception() -> None:
    """While a command runs, let a request raise `KeyboardInterrupt`."""
    heard_at = -1.0

    def interrupt(number: int, frame: FrameType | None) -> None:
        nonlocal heard_at
        del number, frame
        before, heard_at = heard_at, monotonic()
        if heard_at - before >= SAME_REQUEST:
            raise KeyboardInterrupt

    handled_by(interrupt)
    sys.unraisablehook = _tell_if_not_requested


def heard_no_more() -> None:
    """The command has come to its end: all that is left is to say so.

    CPython ends by SIGINT after a `KeyboardInterrupt` that left a piece of code compiled from text,
    as it is in the middle of an import that makes dataclasses, also if it was caught outside of it.
    Another such piece makes it forget that (`run_eval_code_obj` in Python/pythonrun.c).
    """
    handled_by(signal.SIG_IGN)
    exec("")  # noqa: S102 - see above


def _tell_if_not_requested(given: "sys.UnraisableHookArgs") -> None:
    """A request that is heard in a destructor is lost; its traceback helps nobody."""
    if given.exc_type is not KeyboardInterrupt:
        sys.__unraisablehook__(given)
