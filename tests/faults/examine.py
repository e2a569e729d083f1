"""Runs a case, and says what is wrong with what came of it."""

import os
import re
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Final

import numpy as np

from orchestrator.recording.reader import Recording
from orchestrator.run import run_scenario
from orchestrator.scenario.build import load_scenario
from orchestrator.scratch import sweep
from tests.faults.cases import DISK, Case

_LIMIT: Final = 300.0
"""What takes longer hangs [s]."""

_MARK: Final = "NLOSIM_FAULT_CASE"


@dataclass(frozen=True, slots=True, kw_only=True)
class Result:
    """What became of a case.

    Attributes:
        seconds: that it took [s].
        problems: what was not as it is to be; empty if all was.
    """

    exit_code: int | None
    seconds: float
    problems: tuple[str, ...]


def examined(case: Case, folder: Path) -> Result:
    """Run `case` in the new folder `folder`, without its fault and with it."""
    folder.mkdir(parents=True)
    shutil.copy(Path(__file__).with_name("fault_parts.py"), folder)
    scenario = folder / "case.yaml"
    scenario.write_text(case.written())
    calm = run_scenario(
        load_scenario(scenario, _calmed(case)),
        folder / "calm",
        transport="in-process",
        figure=False,
    )
    reference = Recording(calm.directory)
    process = _started(case, folder)
    before = time.monotonic()
    try:
        _disturb(case, folder, process)
        process.wait(_LIMIT)
    except subprocess.TimeoutExpired:
        problems = [f"it hangs: not over after {_LIMIT:g} s"]
        process.kill()
        process.wait()
    else:
        problems = list(_problems(case, folder, process.returncode, reference))
    seconds = time.monotonic() - before
    problems += _left(folder)
    return Result(exit_code=process.returncode, seconds=seconds, problems=tuple(problems))


def _calmed(case: Case) -> list[str]:
    key = f"components.{case.target}"
    return [f"{key}.parameters.deed=none", f"{key}.parameters.has_child=false"]


def _started(case: Case, folder: Path) -> "subprocess.Popen[bytes]":
    temporary = folder / "temporary"
    temporary.mkdir()
    path = os.pathsep.join(filter(None, [str(Path.cwd()), *sys.path]))
    variables = {"TMPDIR": str(temporary), "PYTHONPATH": path, _MARK: str(folder)}
    command = ["run", "case.yaml", "--out", "run", "--quiet", "--no-figure"]
    command += ["--transport", case.transport]
    command += ["--set", f"components.{case.target}.parameters.folder={folder}"]
    with (folder / "run.txt").open("wb") as said:
        return subprocess.Popen(
            [sys.executable, "-m", "orchestrator", *command],
            cwd=folder,
            stdout=said,
            stderr=said,
            env={**os.environ, **variables},
            start_new_session=True,
            preexec_fn=partial(_prepare, is_full=case.fault.kind == "full disk"),  # noqa: PLW1509 - this has no threads
        )


def _prepare(*, is_full: bool) -> None:
    """Hear signals, also where this process ignores them (`nohup`), and fill the disk."""
    for number in (signal.SIGINT, signal.SIGHUP):
        signal.signal(number, signal.SIG_DFL)
    if is_full:
        resource.setrlimit(resource.RLIMIT_FSIZE, (DISK, DISK))


def _disturb(case: Case, folder: Path, process: "subprocess.Popen[bytes]") -> None:
    """Send signals, once the target is where it waits for that."""
    if case.fault.deed != "gate":
        return
    until = time.monotonic() + _LIMIT
    while not (folder / "reached").exists():
        if process.poll() is not None or time.monotonic() > until:
            return
        time.sleep(0.01)
    victims = list(_victims(case, process.pid))
    for victim in victims:
        os.kill(victim, case.fault.number)
    if case.fault.number is signal.SIGSTOP:
        time.sleep(case.pause)
        for victim in victims:
            os.kill(victim, signal.SIGCONT)
    elif case.fault.number is not signal.SIGKILL:
        time.sleep(0.3)
    else:
        return  # what is killed is missed while its victim waits at the gate
    (folder / "go").touch()


def _victims(case: Case, waiting: int) -> Iterator[int]:
    if case.fault.victim == "waiting":
        yield waiting
        return
    marked = dict(_marked(case_mark(waiting)))
    (run,) = (pid for pid, words in marked.items() if _parent(pid) == waiting)
    hosts = {pid: words for pid, words in marked.items() if "host_main" in " ".join(words)}
    # a guard has the same words; its child is the host
    parents = {_parent(pid) for pid in hosts}
    named = [p for p, words in hosts.items() if words[-1] == case.target and p not in parents]
    yield from {"run": [run], "host": named, "all": [*marked]}[case.fault.victim]


def case_mark(pid: int) -> str:
    """What marks all processes of a case, from the environment of one of them."""
    return _environment(pid).get(_MARK, "")


def _environment(pid: int) -> Mapping[str, str]:
    with suppress(OSError):
        entries = Path(f"/proc/{pid}/environ").read_bytes().decode(errors="replace").split("\0")
        return dict(entry.split("=", 1) for entry in entries if "=" in entry)
    return {}


def _marked(mark: str) -> Iterator[tuple[int, list[str]]]:
    """The processes of a case, and their command lines."""
    for entry in Path("/proc").glob("[0-9]*"):
        pid = int(entry.name)
        if pid != os.getpid() and mark and _environment(pid).get(_MARK) == mark:
            with suppress(OSError):
                yield pid, (entry / "cmdline").read_text().rstrip("\0").split("\0")


def _parent(pid: int) -> int:
    with suppress(OSError):
        return int(Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[1])
    return 0


def _problems(case: Case, folder: Path, exit_code: int, reference: Recording) -> Iterator[str]:
    said = (folder / "run.txt").read_text(errors="replace")
    if exit_code != case.exit_code:
        yield f"exit code {exit_code}, not {case.exit_code}: {said[-300:]!r}"
        return
    if "Traceback" in said:
        yield f"a traceback: {said[-300:]!r}"
    pattern = case.fault.says.format(name=case.target)
    if exit_code and not re.search(pattern, said):
        yield f"`{pattern}` is not in {said[-300:]!r}"
    run = folder / "run"
    if exit_code == -signal.SIGKILL:
        _await_release(run)
    recording = Recording(run)
    if recording.manifest["status"] != case.status:
        yield f"status {recording.manifest['status']}, not {case.status}"
    if exit_code == 0:
        ours, theirs = recording.manifest["fingerprint"], reference.manifest["fingerprint"]
        if ours != theirs:
            yield f"another fingerprint, {ours}"
    yield from _differences(recording, reference, is_whole=case.status in {"failed", "interrupted"})
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


def _left(folder: Path) -> list[str]:
    """Processes and files that should be gone."""
    until = time.monotonic() + 3
    while (found := list(_marked(str(folder)))) and time.monotonic() < until:
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
