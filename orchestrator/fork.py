"""A copy of this process that leaves the original and its files alone."""

import gc
import logging
import os
import signal
import stat
import threading
import warnings
from contextlib import suppress
from types import FrameType
from typing import Any, Final

_REQUESTS_TO_STOP: Final = (signal.SIGINT, signal.SIGTERM)


class Fork:
    """A copy of this process, as seen from both; it answers once, in bytes.

    Attributes:
        answer: the open file into which the copy writes.

    Raises:
        OSError: the system refuses another process.
    """

    def __init__(self) -> None:
        self._status = 0
        self._requests = _Postponed()
        self._reading, self.answer = os.pipe()
        try:
            self._copy = _fork()
        except OSError:
            os.close(self._reading)
            os.close(self.answer)
            self._requests.release()
            raise

    @property
    def is_copy(self) -> bool:
        """Whether this process is the copy."""
        return self._copy == 0

    def enter(self) -> None:
        """Cut this process, the copy, off from everything that it shares with the original."""
        os.close(self._reading)
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # a terminal tells both; the original acts
        signal.signal(signal.SIGTERM, signal.SIG_DFL)
        gc.disable()  # finalizers of what other threads of the original own must not run here
        logging.disable()
        _separate_files(keep=self.answer)

    def wait(self) -> bytes:
        """The answer for the original, after the copy has ended; empty if it gave none.

        Whatever interrupts the waiting ends the copy.
        """
        try:
            os.close(self.answer)
            self._requests.release()
            with os.fdopen(self._reading, "rb") as pipe:
                return pipe.read()
        except BaseException:
            os.kill(self._copy, signal.SIGKILL)
            raise
        finally:
            _, self._status = os.waitpid(self._copy, 0)

    @property
    def ending(self) -> str:
        """How the copy ended, as a predicate."""
        code = os.waitstatus_to_exitcode(self._status)
        if code >= 0:
            return f"ended its process with code {code}"
        with suppress(ValueError):
            return f"was killed by {signal.Signals(-code).name}"
        return f"was killed by signal {-code}"


class _Postponed:
    """Requests to stop, held back until nothing gets lost by obeying them.

    While a process is copied, Python swallows what a signal handler raises; later, whoever is
    stopped has to know the copy, to end it. Handlers run in the main thread only, so in others
    nothing has to be held back.
    """

    def __init__(self) -> None:
        self._received: list[int] = []
        self._handlers: dict[int, Any] = {}
        if threading.current_thread() is threading.main_thread():
            for number in _REQUESTS_TO_STOP:
                if signal.getsignal(number) is not None:  # one of C, which cannot be put back
                    self._handlers[number] = signal.signal(number, self._note)

    def _note(self, number: int, frame: FrameType | None) -> None:
        del frame
        self._received.append(number)

    def release(self) -> None:
        """Put the handlers back, and hand over what came meanwhile."""
        for number, handler in self._handlers.items():
            signal.signal(number, handler)
        for number in self._received:
            signal.raise_signal(number)


def _fork() -> int:
    # Python 3.12 warns of other threads, whose locks a copy inherits and never sees released.
    # A simulation in one process calls nothing that takes such a lock: memory allocation, Python's
    # own locks, logging and OpenBLAS prepare themselves for copies.
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)
        return os.fork()


def _separate_files(keep: int) -> None:
    """Give a copy open files of its own.

    A copy shares the position in open files with its original. What it can write goes nowhere
    from here on; what it reads, it opens again, at the same position. (Where an open file cannot
    be opened again independently, as on macOS, reading stays shared.)
    """
    nowhere = os.open(os.devnull, os.O_RDWR)
    for number in _open_files():
        if number in {keep, nowhere}:
            continue
        with suppress(OSError):  # closed meanwhile, or may not be opened again
            _separate(number, nowhere)
    os.close(nowhere)


def _open_files() -> list[int]:
    try:
        return [int(name) for name in os.listdir("/dev/fd")]  # noqa: PTH208 - no directory of files
    except OSError:
        return [1, 2]


def _separate(number: int, nowhere: int) -> None:
    import fcntl  # noqa: PLC0415 - not on Windows, where there are no copies either

    if number in {1, 2}:
        os.dup2(nowhere, number)
        return
    if not stat.S_ISREG(os.fstat(number).st_mode):
        return
    if fcntl.fcntl(number, fcntl.F_GETFL) & os.O_ACCMODE != os.O_RDONLY:
        os.dup2(nowhere, number)
        return
    position = os.lseek(number, 0, os.SEEK_CUR)
    own = os.open(f"/dev/fd/{number}", os.O_RDONLY)
    os.lseek(own, position, os.SEEK_SET)
    os.dup2(own, number)
    os.close(own)
