"""Processes that a benchmark starts."""

import contextlib
import json
import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any, Final, TypeAlias

from orchestrator.errors import CosimError
from orchestrator.remote.process import child_environment

Process: TypeAlias = "subprocess.Popen[bytes]"

_PATIENCE: Final = 5.0
"""How long they may take to end in their own way [s]."""


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


def lines(process: Process) -> Iterator[Any]:
    """What a process says: a line of JSON each, among others that are passed over.

    Raises:
        BrokenProcessError: it has ended, and said nothing more.
    """
    heard = []
    for line in process.stdout or ():
        with contextlib.suppress(ValueError):
            yield json.loads(line)
            continue
        heard.append(line.decode(errors="replace"))
    raise BrokenProcessError(f"{process.args!r} ended early: {''.join(heard[-20:])}")
