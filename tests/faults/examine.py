"""Runs a case, and says what is wrong with what came of it."""

import os
import resource
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Final

from orchestrator.recording.reader import Recording
from orchestrator.run import run_scenario
from orchestrator.scenario.build import load_scenario
from tests.faults.cases import DISK, Case
from tests.faults.company import NICE, company
from tests.faults.judging import LIMIT, Ending, Result, problems, resumed
from tests.faults.processes import case_mark, left, marked, parent, reached, variables

_STARVED: Final = 1800.0
"""The same of a run that hardly gets a processor [s]."""


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
    limit = _STARVED if case.fault.kind == "load" else LIMIT
    before = time.monotonic()
    try:
        with company(9 if case.fault.kind == "load" else 0):
            _disturb(case, folder, process)
            process.wait(limit)
    except subprocess.TimeoutExpired:
        wrong = [f"it hangs: not over after {limit:g} s"]
        process.kill()
        process.wait()
    else:
        says = case.fault.says.format(name=case.target)
        due = Ending(exit_code=case.exit_code, says=says, status=case.status)
        wrong = list(problems(due, folder, process.returncode, reference))
    seconds = time.monotonic() - before
    wrong += left(folder)
    at = None
    if process.returncode and not wrong:
        at, again = resumed(folder, reference)
        wrong += [*again, *left(folder)]
    return Result(exit_code=process.returncode, seconds=seconds, resumed=at, problems=tuple(wrong))


def _calmed(case: Case) -> list[str]:
    key = f"components.{case.target}"
    return [f"{key}.parameters.deed=none", f"{key}.parameters.has_child=false"]


def _started(case: Case, folder: Path) -> "subprocess.Popen[bytes]":
    temporary = folder / "temporary"
    temporary.mkdir()
    command = ["run", "case.yaml", "--out", "run", "--quiet", "--no-figure"]
    command += ["--checkpoint", "100ms"]
    command += ["--transport", case.transport]
    command += ["--set", f"components.{case.target}.parameters.folder={folder}"]
    with (folder / "run.txt").open("wb") as said:
        return subprocess.Popen(
            [sys.executable, "-m", "orchestrator", *command],
            cwd=folder,
            stdout=said,
            stderr=said,
            env=variables(folder),
            start_new_session=True,
            preexec_fn=partial(_prepare, case.fault.kind),  # noqa: PLW1509 - this has no threads
        )


def _prepare(kind: str) -> None:
    """Hear signals, also where this process ignores them (`nohup`); fill the disk, or be nice."""
    for number in (signal.SIGINT, signal.SIGHUP):
        signal.signal(number, signal.SIG_DFL)
    if kind == "load":
        os.nice(NICE)
    if kind == "full disk":
        resource.setrlimit(resource.RLIMIT_FSIZE, (DISK, DISK))


def _disturb(case: Case, folder: Path, process: "subprocess.Popen[bytes]") -> None:
    """Send signals, once the target is where it waits for that."""
    if case.fault.deed != "gate":
        return
    if not reached(folder, process):
        return
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
    own = dict(marked(case_mark(waiting)))
    (run,) = (pid for pid, words in own.items() if parent(pid) == waiting)
    hosts = {pid: words for pid, words in own.items() if "host_main" in " ".join(words)}
    # a guard has the same words; its child is the host
    parents = {parent(pid) for pid in hosts}
    named = [p for p, words in hosts.items() if words[-1] == case.target and p not in parents]
    yield from {"run": [run], "host": named, "all": [*own]}[case.fault.victim]
