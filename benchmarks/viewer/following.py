"""What it costs a run that a browser follows it."""

import os
import re
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Final

from typing_extensions import override

import scenarios
from benchmarks.benchmark import Case, Measurement, PeerFailedError
from benchmarks.viewer.chromium import NoBrowserError, Tab, browser
from orchestrator.recording.layout import INDEX

SCENARIO: Final = Path(scenarios.__file__).with_name("red_light.yaml")
_NLOSIM: Final = (sys.executable, "-m", "orchestrator")
_PATIENCE: Final = 60.0  # [s]
_TICK: Final = 0.02  # [s]
_WINDOW: Final = (1440, 900)
_PAGES: Final = (
    "(performance.getEntriesByType('resource').filter((e) => /page\\/\\d/.test(e.name)))"
)


@dataclass(frozen=True, kw_only=True, eq=False)
class Run(Case):
    """One run of the red light in a process of its own.

    Attributes:
        seconds: simulated [s].
        is_followed: whether `nlosim view --page` shows it in a browser meanwhile.
    """

    seconds: int
    is_followed: bool

    @override
    def measure(self) -> Measurement:
        """Run once.

        Returns:
            `wall_s` and `cpu_s` of the process of the run, loading and recording included; of one
            that is followed `pages` that the browser took, `view_cpu_s` of what made them, and
            `browser_cpu_s` of all its processes.
        """
        with ExitStack() as stack:
            folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
            tab = None
            if self.is_followed:
                try:
                    tab = stack.enter_context(browser(folder / "browser"))
                except NoBrowserError as error:
                    raise PeerFailedError(str(error)) from None
                tab.resize(*_WINDOW)
            return self._measured(folder / "run", tab)

    def _measured(self, out: Path, tab: Tab | None) -> Measurement:
        sets = ["--set", f"time.stop={self.seconds} s", "--set", "measures={}"]
        words = ["run", str(SCENARIO), *sets, "--no-figure", "--quiet", "--json", "--out", str(out)]
        began = time.perf_counter()
        process = _started(words)
        before = tab.processor_time() if tab is not None else 0.0
        with _follower(out, tab, process) as follower:
            wall, cpu = _ended(process, began)
            if tab is not None:
                pages = float(tab.evaluate(f"{_PAGES}.length"))
                drawing = tab.processor_time() - before
        if follower is None:
            return {"wall_s": wall, "cpu_s": cpu}
        _, view = _ended(follower, began)
        more = {"pages": pages, "view_cpu_s": view, "browser_cpu_s": drawing}
        return {"wall_s": wall, "cpu_s": cpu, **more}


def _started(words: Sequence[str]) -> "subprocess.Popen[str]":
    return subprocess.Popen(
        [*_NLOSIM, *words], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True
    )


def _errors(process: "subprocess.Popen[str]") -> IO[str]:
    if process.stderr is None:
        raise ValueError("this process has no pipe for errors")
    return process.stderr


def _ended(process: "subprocess.Popen[str]", began: float) -> tuple[float, float]:
    """Wall time since `began`, and CPU time of a process, when it has ended [s].

    Raises:
        PeerFailedError: it failed.
    """
    _, status, used = os.wait4(process.pid, 0)
    wall = time.perf_counter() - began
    process.returncode = os.waitstatus_to_exitcode(status)
    with _errors(process) as errors:
        said = errors.read()
    if process.returncode:
        raise PeerFailedError(f"a process ended with {process.returncode}: {said[-500:]}")
    return wall, used.ru_utime + used.ru_stime


@contextmanager
def _follower(
    out: Path, tab: Tab | None, run: "subprocess.Popen[str]"
) -> Iterator["subprocess.Popen[str] | None"]:
    """Show a run in a tab; what serves it ends with the block. Nobody without a tab."""
    if tab is None:
        yield None
        return
    end = time.monotonic() + _PATIENCE
    while not (out / INDEX).exists():
        if time.monotonic() > end or run.poll() is not None:
            raise PeerFailedError("the run has not begun")
        time.sleep(_TICK)
    follower = _started(["view", "--page", str(out), "--port", "0"])
    try:
        line = _errors(follower).readline()
        address = re.match(r"http://\S+", line)
        if address is None:
            raise PeerFailedError(f"nothing is served: {line}")
        tab.call("Page.navigate", url=address[0])
        yield follower
    finally:
        follower.send_signal(signal.SIGINT)
