"""Starts pytest: in a process of its own, by one that has imported the foreign libraries."""

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from threading import Thread
from typing import Final

from orchestrator.reaping import children_of

_SCRIPT: Final = Path(__file__).with_name("warm_start.py")
FOREIGN: Final = (
    "numpy",
    "yaml",
    "pydantic",
    "lxml.etree",
    "fmpy",
    "pytest",
    "hypothesis",
    "backports.zstd",
    "safetensors",
    "matplotlib.figure",
    "tqdm",
    "shapely",
    "zenoh",
    "libsumo",
    "torch",
)
"""What is imported before; where one is missing, it is left out."""


class Started:
    """A process of pytest."""

    def __init__(self, server: "subprocess.Popen[str]") -> None:
        self._server = server
        assert server.stdout is not None
        self.pid = int(server.stdout.readline())
        self._begin = time.monotonic()
        self._code: int | None = None
        self._thread = Thread(target=self._wait)
        self._thread.start()

    def poll(self) -> int | None:
        """The exit code; none while it runs."""
        return self._code

    def computed(self) -> float:
        """Time of processors that it has taken [s]; that of the clock where this is not known."""
        try:
            fields = Path(f"/proc/{self.pid}/stat").read_text().rpartition(")")[2].split()
        except OSError:
            return time.monotonic() - self._begin
        return sum(map(int, fields[11:13])) / os.sysconf("SC_CLK_TCK")

    def end(self) -> None:
        """Kill it if it runs, and all that it started, whatever their sessions are."""
        if self._code is None:
            for each in (*_descendants(self.pid), self.pid):
                with suppress(ProcessLookupError, PermissionError):
                    os.kill(each, signal.SIGKILL)
        self._thread.join()

    def _wait(self) -> None:
        assert self._server.stdout is not None
        self._code = int(self._server.stdout.readline())


class Starter:
    """Starts one process of pytest at a time.

    Args:
        foreign: modules that are imported once for all of them.
    """

    def __init__(self, foreign: Sequence[str] = FOREIGN) -> None:
        self._foreign = foreign
        self._server: subprocess.Popen[str] | None = None

    def start(
        self, words: Sequence[str], *, environment: Mapping[str, str], folder: Path, output: Path
    ) -> Started:
        """Run pytest with these words.

        Args:
            words: what to run, and how.
            environment: all its variables.
            folder: where it runs; the first place where Python looks for modules.
            output: a file for what it says.
        """
        if self._server is None or self._server.poll() is not None:
            self._server = subprocess.Popen(
                [sys.executable, str(_SCRIPT), *self._foreign],
                env=dict(environment),
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                text=True,
                start_new_session=True,
            )
        asked = {
            "words": list(words),
            "environment": dict(environment),
            "folder": str(folder),
            "output": str(output),
        }
        assert self._server.stdin is not None
        self._server.stdin.write(json.dumps(asked) + "\n")
        self._server.stdin.flush()
        return Started(self._server)

    def close(self) -> None:
        """End the process that starts others."""
        if self._server is not None:
            assert self._server.stdin is not None
            assert self._server.stdout is not None
            self._server.stdin.close()
            self._server.wait()
            self._server.stdout.close()
        self._server = None


def _descendants(pid: int) -> list[int]:
    children = children_of(pid)
    return [below for child in children for below in (*_descendants(child), child)]
