"""Runs tests in the copy of the tree, until one fails or hangs."""

import json
import os
import time
from collections.abc import Collection, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from tests.mutation.reach import KnownTest
from tests.mutation.starting import Started, Starter
from tests.mutation.trial_plugin import TRIAL

_NOTHING_FAILED: Final = (0, 5)
_POLL: Final = 0.1
_STARTER: Final = Starter()


class TrialError(Exception):
    """pytest itself did not work; the message has what it said."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Outcome:
    """How a run of tests ended.

    Attributes:
        verdict: `killed`, `survived` or `timeout`.
        killer: the test that failed or hung; empty if none.
        ran: how many tests began.
    """

    verdict: str
    killer: str
    ran: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Patience:
    """How long a single test may take before it counts as hanging.

    Attributes:
        least: whatever it took before [s].
        factor: of the time that it took before.
    """

    least: float = 60.0
    factor: float = 10.0

    def limit(self, usual: float) -> float:
        """The longest time [s] of a test that took `usual` seconds; of the collection with 0."""
        return self.least + self.factor * usual


@dataclass(frozen=True, slots=True, kw_only=True)
class Limits:
    """How long the tests of files may compute: no other begins when that is over.

    Attributes:
        all: of all of them together [s].
        file: of each file [s].
    """

    all: float = 60.0
    file: float = 15.0


def run(
    tree: Path,
    work: Path,
    tests: Sequence[KnownTest],
    patience: Patience = Patience(),
) -> Outcome:
    """Run tests in this order, up to the first that fails or hangs.

    Args:
        tree: the copy of the tree; the tests are those of it.
        work: a folder for what pytest says.
        tests: node IDs with the time that each took.
        patience: with a test, and with the collection of all.

    Raises:
        TrialError: no test was run for another reason than that the code is broken.
    """
    files = list(dict.fromkeys(test.file for test in tests))
    wanted = {"tests": [test.name for test in tests]}
    usual = {test.name: test.seconds for test in tests}
    return _run(tree, work, files, wanted, usual=usual, patience=patience)


def run_files(
    tree: Path,
    work: Path,
    files: Sequence[str],
    limits: Limits,
    *,
    left_out: Collection[str] = (),
    patience: Patience = Patience(),
) -> Outcome:
    """Run the tests of files that are not slow in this order, up to the first that fails or hangs.

    Args:
        tree: the copy of the tree.
        work: a folder for what pytest says.
        files: paths in the tree.
        limits: how long.
        left_out: names of tests and files that are not run.
        patience: with a test, and with the collection of all.

    Raises:
        TrialError: no test was run for another reason than that the code is broken.
    """
    wanted = {
        "seconds": limits.all,
        "seconds_of_file": limits.file,
        "left_out": list(left_out),
    }
    files = [file for file in files if file not in left_out]
    if not files:  # without a name pytest would take all that there are
        return Outcome(verdict="survived", killer="", ran=0)
    return _run(tree, work, files, wanted, usual={}, patience=patience)


def _run(
    tree: Path,
    work: Path,
    files: Sequence[str],
    wanted: Mapping[str, object],
    *,
    usual: Mapping[str, float],
    patience: Patience,
) -> Outcome:
    progress, said = work / "progress.jsonl", work / "output.txt"
    progress.write_text("")
    trial = work / "trial.json"
    trial.write_text(json.dumps({**wanted, "progress": str(progress)}))
    process = _STARTER.start(
        ["-x", "-q", "-p", "no:xdist", "-p", "tests.mutation.trial_plugin", *files],
        environment=environment(tree) | {TRIAL: str(trial)},
        folder=tree,
        output=said,
    )
    try:
        code = _awaited(process, progress, usual, patience)
    finally:
        process.end()
    seen = _Progress.read(progress)
    if code is None:
        return Outcome(verdict="timeout", killer=seen.running, ran=seen.started)
    if code in _NOTHING_FAILED and not seen.failed:
        if code and usual:
            raise TrialError(f"pytest found none of the tests:\n{_tail(said)}")
        return Outcome(verdict="survived", killer="", ran=seen.started)
    killer = seen.failed or seen.running or _unread(code, said)
    return Outcome(verdict="killed", killer=killer, ran=seen.started)


def environment(tree: Path) -> dict[str, str]:
    """Variables with which Python takes the code of the copy, with one thread."""
    threads = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1")
    others = {"PYTEST_CURRENT_TEST", "PYTEST_ADDOPTS", "PYTHONDONTWRITEBYTECODE"}
    kept = {name: value for name, value in os.environ.items() if name not in others}
    return {**threads, **kept, "PYTHONPATH": str(tree), "MPLBACKEND": "Agg"}


@dataclass(frozen=True, slots=True, kw_only=True)
class _Progress:
    """What the plug-in has written."""

    started: int
    running: str
    failed: str

    @classmethod
    def read(cls, path: Path) -> "_Progress":
        started, running, failed = 0, "", ""
        for line in path.read_text("utf-8").splitlines():
            with suppress(ValueError):  # the last line may be cut
                match json.loads(line):
                    case {"start": str() as name}:
                        started, running = started + 1, name
                    case {"ended": str()}:
                        running = ""
                    case {"failed": str() as name} if not failed:
                        failed = name
        return cls(started=started, running=running, failed=failed)


def _awaited(
    process: Started,
    progress: Path,
    usual: Mapping[str, float],
    patience: Patience,
) -> int | None:
    """The exit code; none where a test hangs.

    Between tests, and before the first, what the process computes counts: to import modules takes
    long where others compute, too.
    """
    size, since, computed = 0, time.monotonic(), 0.0
    while (code := process.poll()) is None:
        time.sleep(_POLL)
        if (now := progress.stat().st_size) != size:
            size, since, computed = now, time.monotonic(), process.computed()
        running = _Progress.read(progress).running
        spent = time.monotonic() - since if running else process.computed() - computed
        if spent > patience.limit(usual.get(running, 0.0)):
            return None
    return code


def _unread(code: int, said: Path) -> str:
    """What to name where pytest ended before any test."""
    if "conftest" in (tail := _tail(said)) or code < 0 or "Error" in tail:
        return "collection"
    raise TrialError(f"pytest ended with code {code}:\n{tail}")


def _tail(path: Path) -> str:
    return path.read_text("utf-8", errors="replace")[-2000:]
