"""A run that crashes still ends with a message: another process waits for it.

The command goes on in a copy of this process (`fork`), before anything is loaded, and this one does
nothing but wait for its end. What the copy cannot say itself, killed by a signal or ended by
`exit()` in a component, is said here, from what the run noted last (`orchestrator.last_call`).
Linux only; elsewhere `nlosim report` says it.
"""

import faulthandler
import os
import signal
import sys
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Final

from orchestrator.cli.outcome import Exit, Outcome, failure
from orchestrator.cli.patience import Patience
from orchestrator.cli.requests import heard_no_more, requests
from orchestrator.cli.shortage import cut_short
from orchestrator.last_call import FILE
from orchestrator.log import LOG
from orchestrator.process_end import ended
from orchestrator.reaping import adopt, die_with, end_children
from orchestrator.scratch import sweep

_WATCHED: Final = (["run"], ["resume"], ["rerun"], ["fmu", "run"], ["fmu", "compare"])
"""Commands that call components in their process."""


class Watch:
    """What the process that runs tells the one that waits; without one, nothing."""

    def __init__(self) -> None:
        self._pipe: int | None = None

    def told_by(self, pipe: int) -> None:
        """Write what is to be told into `pipe` from now on."""
        self._pipe = pipe

    @property
    def is_told(self) -> bool:
        """Whether a process waits for this one."""
        return self._pipe is not None

    def begin(self, directory: Path, *, private: bool = False) -> None:
        """A run has begun in `directory`.

        If it crashes, its log has the stack of Python, too, unless nobody shall see where its
        files are.
        """
        if self._pipe is None:
            return
        os.write(self._pipe, os.fsencode(directory.absolute()) + b"\0")
        if private:
            return
        log = os.open(directory / LOG, os.O_WRONLY | os.O_APPEND | os.O_CREAT, 0o644)
        faulthandler.enable(log)

    def end(self) -> None:
        """The command has said what it came to."""
        if self._pipe is not None:
            with suppress(OSError):  # nobody waits any more
                os.write(self._pipe, b"\0")


WATCH: Final = Watch()


def is_watched(arguments: Sequence[str]) -> bool:
    """Whether the command is worth another process, and this system has what it takes."""
    named = [argument for argument in arguments if not argument.startswith("-")]
    is_asked = any(named[: len(words)] == words for words in _WATCHED)
    return is_asked and not {"-h", "--help"} & set(arguments) and sys.platform == "linux"


def watched() -> Outcome | int | None:
    """Go on in a copy of this process, and wait for it here.

    Returns:
        `None` in the copy, and where there can be none. In the process that waited, the exit code
        of the copy, or what there is to say if a run in it was cut off.
    """
    reading, writing = os.pipe()
    waiting = {signal.SIGCHLD, *requests()}
    before = signal.pthread_sigmask(signal.SIG_BLOCK, waiting)
    here = os.getpid()
    adopt()
    try:
        copy = os.fork()
    except OSError:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
        return None
    if copy == 0:
        os.close(reading)
        die_with(here)
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
        WATCH.told_by(writing)
        return None
    os.close(writing)
    told = _Told(reading)
    patience = Patience(told.directory)
    status = _status_of(copy, waiting, patience)
    heard_no_more()  # the copy has said all there is to say
    signal.pthread_sigmask(signal.SIG_SETMASK, before)
    directory, is_told = told.directory(), told.is_ended
    os.close(reading)
    if os.WIFSIGNALED(status):
        end_children()  # of components in that process; hosts see to theirs
    crash = None if directory is None else _crash(directory, status, is_hang=patience.is_over)
    if crash is None and not is_told and not patience.is_over and _is_sudden(status):
        crash = cut_short(ended(os.waitstatus_to_exitcode(status)))
    if crash is not None:
        return crash
    if os.WIFSIGNALED(status):
        signal.signal(os.WTERMSIG(status), signal.SIG_DFL)
        os.kill(here, os.WTERMSIG(status))
    return os.waitstatus_to_exitcode(status)


class _Told:
    """What comes out of the pipe of a `Watch`."""

    def __init__(self, pipe: int) -> None:
        os.set_blocking(pipe, False)
        self._pipe = pipe
        self._content = b""

    def directory(self) -> Path | None:
        """The directory of the run that was begun last; `None` if none was."""
        with suppress(BlockingIOError):
            while more := os.read(self._pipe, 4096):
                self._content += more
        found = [name for name in self._content.split(b"\0")[:-1] if name]
        return Path(os.fsdecode(found[-1])) if found else None

    @property
    def is_ended(self) -> bool:
        """Whether the command had said what it came to when `directory` was asked for last."""
        return self._content.endswith(b"\0\0") or self._content == b"\0"


def _is_sudden(status: int) -> bool:
    """Whether a process ended by itself, not by request."""
    return not os.WIFSIGNALED(status) or os.WTERMSIG(status) not in {*requests(), signal.SIGKILL}


def _status_of(copy: int, waiting: set[signal.Signals], patience: Patience) -> int:
    """Wait for the copy; what others ask of this process is asked of it."""
    while True:
        pause = patience.pause
        news = signal.sigwaitinfo(waiting) if pause is None else signal.sigtimedwait(waiting, pause)
        if news is None:
            patience.look()
            if patience.is_over:
                os.kill(copy, signal.SIGKILL)
        elif news.si_signo != signal.SIGCHLD:
            patience.ask()
            if news.si_code <= 0:
                os.kill(copy, news.si_signo)  # a terminal, whose code is positive, tells both
        done, status = os.waitpid(copy, os.WNOHANG)
        if done:
            return status


def _crash(directory: Path, status: int, *, is_hang: bool) -> Outcome | None:
    if not (directory / FILE).exists():
        return None
    from orchestrator.recording.crash import conclude  # noqa: PLC0415 - NumPy takes a while

    how = f"the process {ended(os.waitstatus_to_exitcode(status))}"
    what = "crash"
    if is_hang:
        how, what = "it did not come back when the run was asked to stop, and was killed", "hang"
    found = conclude(directory, how, what)
    if found is None:
        return None
    sweep()  # the copy could not
    recorded = f"\nrecorded until then: {directory}" if directory.is_dir() else ""
    return failure(
        what,
        Exit.COMPONENT_FAILED,
        found.text,
        text=f"error: {found.text}{recorded}",
        component=found.last.component,
        time_s=found.last.time / 1e9,
        out=str(directory),
    )
