"""The program `nlosim` as a process of its own, and what it leaves behind."""

import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from orchestrator.scratch import sweep
from tests.faults.processes import marked
from tests.reliability.commands import Said

_MARK: Final = "NLOSIM_FAULT_CASE"
_ROOT: Final = Path(__file__).parents[2]


@dataclass(frozen=True, slots=True, kw_only=True)
class Program:
    """A command in a folder.

    Attributes:
        folder: in which it runs; marks all processes that belong to it.
        arguments: without the program's name.
        variables: of its environment, beside those of this process.
        prepare: is called in the process before it begins.
    """

    folder: Path
    arguments: Sequence[str]
    variables: Mapping[str, str] = field(default_factory=dict)
    prepare: Callable[[], None] = field(default=lambda: None)

    @property
    def temporary(self) -> Path:
        """The folder for temporary files of all that belongs to it."""
        return self.folder / "temporary"

    def started(self, stdout: int | None = None) -> "subprocess.Popen[bytes]":
        """The process; what it says is in `said.txt`, unless its output goes to `stdout`."""
        self.temporary.mkdir(exist_ok=True)
        path = os.pathsep.join([str(_ROOT), *filter(None, sys.path)])
        own = {"TMPDIR": str(self.temporary), "PYTHONPATH": path, _MARK: str(self.folder)}
        with (self.folder / "said.txt").open("ab") as said:
            return subprocess.Popen(
                [sys.executable, "-m", "orchestrator", *self.arguments],
                cwd=self.folder,
                stdin=subprocess.DEVNULL,
                stdout=said if stdout is None else stdout,
                stderr=said,
                env={**os.environ, **own, **self.variables},
                start_new_session=True,
                preexec_fn=self._prepare,  # noqa: PLW1509 - this process has no threads
            )

    def _prepare(self) -> None:
        for number in (signal.SIGINT, signal.SIGHUP, signal.SIGTERM):
            signal.signal(number, signal.SIG_DFL)  # who ignores them passes that on
        self.prepare()

    def said(self, code: int) -> Said:
        """What it said until it ended with `code`."""
        return Said(code, (self.folder / "said.txt").read_text(errors="replace"))

    def run(self, seconds: float) -> Said:
        """Run it to its end; exit code 124 after `seconds` [s]."""
        process = self.started()
        try:
            code = process.wait(seconds)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
            code = 124
        return self.said(code)

    def left(self) -> str:
        """What should be gone, as a line; processes are ended. Temporary folders are swept."""
        until = time.monotonic() + 5
        while (found := list(marked(str(self.folder)))) and time.monotonic() < until:
            time.sleep(0.05)
        for pid, _ in found:
            with suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)
        with _temporary(self.temporary):
            sweep()  # as the next command does after a kill
        files = [path.name for path in self.temporary.iterdir()] if self.temporary.exists() else []
        return "; ".join([*(f"left: {' '.join(words)}" for _, words in found), *files])


@contextmanager
def _temporary(folder: Path) -> Iterator[None]:
    before = tempfile.tempdir
    tempfile.tempdir = str(folder)
    try:
        yield
    finally:
        tempfile.tempdir = before
