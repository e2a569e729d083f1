"""What became of a run, and what is wrong with it."""

import json
import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from orchestrator.recording.reader import Recording
from tests.faults.processes import variables

LIMIT: Final = 300.0
"""What takes longer hangs [s]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Result:
    """What became of a case.

    Attributes:
        seconds: that it took [s].
        resumed: where it was gone on with [s]; `None` if it came to its end.
        problems: what was not as it is to be; empty if all was.
    """

    exit_code: int | None
    seconds: float
    resumed: float | None
    problems: tuple[str, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Ending:
    """How a run is to end.

    Attributes:
        says: a pattern that its error message has.
        status: of the manifest, or as a reader sees it.
    """

    exit_code: int
    says: str
    status: str


def problems(due: Ending, folder: Path, exit_code: int, reference: Recording) -> Iterator[str]:
    """What is not as it is to be of the run in `folder`.

    Args:
        due: how it is to end.
        folder: with its recording `run`, and what it said in run.txt.
        exit_code: with which it ended.
        reference: the same run, without a fault.
    """
    said = (folder / "run.txt").read_text(errors="replace")
    if exit_code != due.exit_code:
        yield f"exit code {exit_code}, not {due.exit_code}: {said[-300:]!r}"
        return
    if "Traceback" in said:
        yield f"a traceback: {said[-300:]!r}"
    if exit_code and not re.search(due.says, said):
        yield f"`{due.says}` is not in {said[-300:]!r}"
    run = folder / "run"
    if exit_code == -signal.SIGKILL:
        _await_release(run)
    recording = Recording(run)
    if recording.manifest["status"] != due.status:
        yield f"status {recording.manifest['status']}, not {due.status}"
    if exit_code == 0:
        ours, theirs = recording.manifest["fingerprint"], reference.manifest["fingerprint"]
        if ours != theirs:
            yield f"another fingerprint, {ours}"
    yield from _differences(recording, reference, is_whole=due.status in {"failed", "interrupted"})
    size = (run / "log.txt").stat().st_size
    if size > 2_500_000:
        yield f"the log has {size} bytes"


def _await_release(run: Path) -> None:
    """Who was killed takes the run with it, which is not at once."""
    until = time.monotonic() + 10
    while Recording(run).manifest["status"] == "running" and time.monotonic() < until:
        time.sleep(0.02)


def _differences(recording: Recording, reference: Recording, *, is_whole: bool) -> Iterator[str]:
    """Where a recording is not the beginning of another one."""
    is_full = "File too large" in str(recording.manifest.get("error"))
    for place in recording.damage:
        if not (is_full and "without its end" in str(place)):
            yield f"damage: {place}"
    last = 0
    for name in recording.signals:
        ours, theirs = recording[name], reference[name]
        count = len(ours)
        last = max([last, *np.asarray(ours.times).tolist()])
        if not np.array_equal(ours.values, theirs.values[:count]):
            yield f"`{name}` has other values"
    reached = recording.manifest.get("reached_ns")
    if is_whole and not is_full and reached is not None and last > reached:
        yield f"the recording goes to {last} ns, and {reached} ns were reached"
    if is_whole and not is_full and last != _last_due(reference, reached or 0):
        yield f"the recording ends at {last} ns, not at the last point up to {reached} ns"


def _last_due(reference: Recording, reached: int) -> int:
    """The last communication point of a run that came to `reached` [ns]."""
    times: list[int] = [
        t for n in reference.signals for t in np.asarray(reference[n].times).tolist()
    ]
    return max((t for t in times if t <= reached), default=0)


def resumed(folder: Path, reference: Recording) -> tuple[float | None, list[str]]:
    """Where the run was gone on with [s], and what is wrong with what it came to."""
    command = ["resume", "run", "--quiet", "--no-figure", "--json"]
    done = subprocess.run(
        [sys.executable, "-m", "orchestrator", *command],
        cwd=folder,
        env=variables(folder),
        capture_output=True,
        timeout=LIMIT,
        check=False,
    )
    said = done.stdout.decode(errors="replace")
    if done.returncode:
        return None, [f"resumed with exit code {done.returncode}: {said[-300:]!r}"]
    outcome = json.loads(said)
    if outcome["fingerprint"] != reference.manifest["fingerprint"]:
        return None, [f"resumed to another fingerprint, {outcome['fingerprint']}"]
    return float(outcome["resumed_at_s"]), []
