"""One run of a campaign, as a worker performs it: plain values in, plain values out.

A worker's process has threads of its own. A run that branches copies its process, which does not
go well with them; such a run gets a fresh process: this module is its program.
"""

import json
import math
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from typing_extensions import override

from orchestrator.errors import CosimError, defects, in_words
from orchestrator.hosts_file import read_hosts
from orchestrator.observer import Observer, SimulationResult
from orchestrator.remote.process import child_environment
from orchestrator.run import run_scenario
from orchestrator.run_directory import new_directory
from orchestrator.run_outcome import RunInterrupted, RunOutcome
from orchestrator.scenario.build import load_scenario
from orchestrator.scenario.model import Scenario
from orchestrator.scratch import scratch
from orchestrator.signal import Signals
from orchestrator.system import System
from orchestrator.timebase import Time
from orchestrator.wording import Privately


@dataclass(frozen=True, slots=True, order=True)
class RunKey:
    """Which run of a campaign.

    Attributes:
        seed: of the run.
        combination: the index of its combination of levels; 0 if there is one run per seed.
    """

    seed: int
    combination: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Work:
    """What a worker has to know.

    Attributes:
        scenario: the absolute path of the scenario file.
        overrides: as `nlosim run --set` takes them, the seed among them.
        keep: the run directory to create (numbered if it exists); `None` keeps nothing.
        scratch: where to run if nothing is kept; `None`: the worker's temporary directory.
        transport: see `run_scenario`.
        hosts: the absolute path of the hosts file; `None`: all components are here.
        private: see `run_scenario`; then an error names no folder, either.
    """

    scenario: str
    overrides: tuple[str, ...]
    keep: str | None
    scratch: str | None
    transport: str | None = None
    hosts: str | None = None
    private: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Result:
    """What became of a run.

    Attributes:
        wall: how long it took, start and report included [s].
        fingerprint: of the recording; `None` if the run failed.
        metrics: all of the scenario's report; empty if the run failed.
        error: why it failed, or `None`.
        cpu: processor time of its process and of those that it started [s]; `None` if the worker
            died, and in journals of versions that did not note it.
    """

    wall: float
    fingerprint: str | None
    metrics: Mapping[str, Any]
    error: str | None
    cpu: float | None = None


def perform(work: Work) -> Result:
    """Run; errors become results, because not every exception survives the way back.

    The workers keep all cores busy already, so components have no threads of their own in any run
    of this process (`NLOSIM_THREADS`), unless the environment says otherwise.
    """
    os.environ.setdefault("NLOSIM_THREADS", "1")
    begin, spent = time.perf_counter(), _processor_time()
    try:
        scenario = load_scenario(Path(work.scenario), work.overrides)
        branches = any(use.type.decides for use in scenario.components.values())
        if branches and sys.platform != "win32":
            result = _alone(work)
        else:
            result = _run(work, scenario)
    except RunInterrupted as error:
        result = _failed(_reason(work, error))
    except defects() as error:
        result = _failed(_reason(work, error))
    return replace(result, wall=time.perf_counter() - begin, cpu=_processor_time() - spent)


def _processor_time() -> float:
    """What this process, which performs one run at a time, and its ended children took so far [s].

    Unlike wall time it says what a run costs where other programs want the processors, too.
    """
    return math.fsum(os.times()[:4])  # of itself: user and system; of its children: the same


def _reason(work: Work, error: BaseException) -> str:
    said = str(error) if isinstance(error, CosimError | RunInterrupted) else in_words(error)
    near = [Path(each).parent for each in (work.scenario, work.keep) if each is not None]
    return Privately(*near).text(said) if work.private else said


def _failed(reason: str) -> Result:
    return Result(wall=0.0, fingerprint=None, metrics={}, error=reason)


def _run(work: Work, scenario: Scenario, observers: Sequence[Observer] = ()) -> Result:
    if work.keep is not None:
        keep = Path(work.keep)
        directory = new_directory(keep.parent, keep.name)
        outcome = _outcome(work, scenario, directory, observers)
    else:
        with _folder(work.scratch) as directory:
            outcome = _outcome(work, scenario, directory, observers)
    return Result(wall=0.0, fingerprint=outcome.fingerprint, metrics=outcome.metrics, error=None)


def _outcome(
    work: Work, scenario: Scenario, directory: Path, observers: Sequence[Observer]
) -> RunOutcome:
    return run_scenario(
        scenario,
        directory,
        figure=False,
        observers=observers,
        transport=work.transport,
        hosts=None if work.hosts is None else read_hosts(Path(work.hosts)),
        private=work.private,
    )


@contextmanager
def _folder(parent: str | None) -> Iterator[Path]:
    """A directory of a run of which nothing is kept."""
    if parent is None:
        with scratch("run") as folder:
            yield folder
    else:
        with tempfile.TemporaryDirectory(dir=parent, prefix="run-") as name:
            yield Path(name)


def _alone(work: Work) -> Result:
    """Run in a fresh process, which ends with this one."""
    reading, writing = os.pipe()
    with (
        os.fdopen(reading, "rb") as answers,
        subprocess.Popen(
            [sys.executable, "-P", "-m", "orchestrator.campaign.work", str(writing)],
            stdin=subprocess.PIPE,
            pass_fds=(writing,),
            env=child_environment(),
            text=True,
        ) as process,
    ):
        os.close(writing)
        with suppress(BrokenPipeError):  # it has died; what it did not answer says so
            if process.stdin is not None:
                process.stdin.write(json.dumps(asdict(work)))
                process.stdin.close()
        answer = answers.read()
    if not answer:
        code = process.returncode
        how = f"was killed by signal {-code}" if code < 0 else f"exited with code {code}"
        return _failed(f"the process of the run {how}")
    return Result(**json.loads(answer))


class _EndWithWorker(Observer):
    """Stops a run that nobody waits for any more, because the worker is gone."""

    sees_stretches = True

    def __init__(self) -> None:
        self._worker = os.getppid()

    @override
    def begin(self, system: System, start: Time, stop: Time) -> None:
        pass

    @override
    def observe(self, t: Time, published: tuple[str, ...], values: Mapping[str, Signals]) -> None:
        if os.getppid() != self._worker:
            raise KeyboardInterrupt

    @override
    def end(self, result: SimulationResult) -> None:
        pass


def _main(answers: int) -> None:
    """Read the work from standard input, run, and write the result to the open file `answers`."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # from a terminal; the conductor acts on it
    observer = _EndWithWorker()
    work = Work(**json.load(sys.stdin))
    try:
        scenario = load_scenario(Path(work.scenario), work.overrides)
        result = _run(work, scenario, (observer,))
    except RunInterrupted as error:
        result = _failed(_reason(work, error))
    except defects() as error:
        result = _failed(_reason(work, error))
    with os.fdopen(answers, "w") as file:
        json.dump(asdict(result), file)


if __name__ == "__main__":
    _main(int(sys.argv[1]))
