"""The processes of a case, and what they leave."""

import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Final

from orchestrator.scratch import sweep

_MARK: Final = "NLOSIM_FAULT_CASE"


def variables(folder: Path) -> Mapping[str, str]:
    """The environment of a case."""
    path = os.pathsep.join(filter(None, [str(Path.cwd()), *sys.path]))
    own = {"TMPDIR": str(folder / "temporary"), "PYTHONPATH": path, _MARK: str(folder)}
    return {**os.environ, **own}


def reached(folder: Path, process: "subprocess.Popen[bytes]") -> bool:
    """Whether the target waits in its step for what happens there; waits for it."""
    until = time.monotonic() + 300
    while not (folder / "reached").exists():
        if process.poll() is not None or time.monotonic() > until:
            return False
        time.sleep(0.01)
    return True


def case_mark(pid: int) -> str:
    """What marks all processes of a case, from the environment of one of them."""
    return _environment(pid).get(_MARK, "")


def _environment(pid: int) -> Mapping[str, str]:
    with suppress(OSError):
        entries = Path(f"/proc/{pid}/environ").read_bytes().decode(errors="replace").split("\0")
        return dict(entry.split("=", 1) for entry in entries if "=" in entry)
    return {}


def marked(mark: str) -> Iterator[tuple[int, list[str]]]:
    """The processes of a case, and their command lines."""
    for entry in Path("/proc").glob("[0-9]*"):
        pid = int(entry.name)
        if pid != os.getpid() and mark and _environment(pid).get(_MARK) == mark:
            with suppress(OSError):
                yield pid, (entry / "cmdline").read_text().rstrip("\0").split("\0")


def parent(pid: int) -> int:
    with suppress(OSError):
        return int(Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[1])
    return 0


def left(folder: Path) -> list[str]:
    """Processes and files that should be gone."""
    until = time.monotonic() + 3
    while (found := list(marked(str(folder)))) and time.monotonic() < until:
        time.sleep(0.02)
    problems = [f"left: {' '.join(words)}" for _, words in found]
    for pid, _ in found:
        with suppress(ProcessLookupError):
            os.kill(pid, signal.SIGKILL)
    with _temporary(folder / "temporary"):
        sweep()  # as the next command does after a kill
    files = [path.name for path in (folder / "temporary").iterdir()]
    return problems + [f"left: {name}" for name in files]


@contextmanager
def _temporary(folder: Path) -> Iterator[None]:
    before = tempfile.tempdir
    tempfile.tempdir = str(folder)
    try:
        yield
    finally:
        tempfile.tempdir = before
