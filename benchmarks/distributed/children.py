"""Processes that a benchmark starts."""

import contextlib
import json
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any, Final, TypeAlias

from orchestrator.errors import CosimError
from orchestrator.remote.process import child_environment

Process: TypeAlias = "subprocess.Popen[bytes]"

_PATIENCE: Final = 5.0
"""How long they may take to end in their own way [s]."""


_LONGEST: Final = 300.0
"""How long they may take to say what they found [s]; federates of HELICS may wait for ever."""


class BrokenProcessError(CosimError):
    """A process of a participant ended without its result."""


def spawn(module: str, arguments: Sequence[object], descriptors: Sequence[int] = ()) -> Process:
    """Start `python -m module` with these arguments; what it prints can be read."""
    return subprocess.Popen(
        [sys.executable, "-P", "-m", module, *map(str, arguments)],
        env=child_environment(),
        pass_fds=tuple(descriptors),
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
    )


@contextmanager
def ended(processes: Sequence[Process]) -> Iterator[None]:
    """End these processes behind the block: in their own way, or by force."""
    with killed(processes):
        yield
        for process in processes:
            process.communicate(timeout=_PATIENCE)


@contextmanager
def killed(processes: Sequence[Process]) -> Iterator[None]:
    """End these processes by force behind the block."""
    try:
        yield
    finally:
        for process in processes:
            process.kill()
            process.communicate()


def hear(process: Process, longest: float = _LONGEST) -> Any:
    """What a process says next: a line of JSON, among others that are passed over.

    Args:
        process: that says it on its standard output.
        longest: how long it may take to [s]; after that it is killed.

    Raises:
        BrokenProcessError: it has ended without, or is silent.
    """
    heard: list[str] = []
    with _killed_after(longest, process) as is_silent:
        for line in process.stdout or ():
            with contextlib.suppress(ValueError):
                return json.loads(line)
            heard.append(line.decode(errors="replace"))
    how = f"said nothing for {longest:g} s" if is_silent() else "ended early"
    command = process.args if isinstance(process.args, list) else [process.args]
    what = " ".join(map(str, command[2:]))  # as `spawn` made it, without where Python is here
    raise BrokenProcessError(f"`python {what}` {how}: {''.join(heard[-20:])}")


@contextmanager
def _killed_after(longest: float, process: Process) -> Iterator[Callable[[], bool]]:
    """Kill a process if the block takes longer [s]; gives whether that happened."""
    is_over = threading.Event()

    def kill() -> None:
        is_over.set()
        process.kill()

    timer = threading.Timer(longest, kill)
    timer.start()
    try:
        yield is_over.is_set
    finally:
        timer.cancel()
