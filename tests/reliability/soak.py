"""Area `soak`: long runs, of which the second half must take no more than the first one."""

import json
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from time import monotonic, sleep
from typing import Final

from orchestrator.last_call import called
from orchestrator.scenario.installed import installed_scenario
from tests.reliability.area import Outcome, of_cases
from tests.reliability.processes import Usage, usage

GROWTH_MB: Final = 24.0
"""Memory that the second half of a run may have beyond the first one [MB]."""

SLOWER: Final = 1.5
"""How many times more processor time the second half may take."""

BYTES_PER_VALUE: Final = 17.0
"""Of a recording, per value: 8 for it, 8 for its time, and what holds them [byte]."""

_OVERHEAD_MB: Final = 1.0
_NOTICEABLE: Final = 1.0  # of processor time [s]
_FEWEST: Final = 2
_LOOK: Final = 0.05
"""The longest time until somebody looks again [s]; a hundredth of the run's age before."""
_LONGEST: Final = 4 * 3600.0  # [s]
_MEGABYTE: Final = 1e6
_STEP: Final = "1 ms"

_CHEAP: Final = f"""\
schema: 1
title: Two lags
time: {{stop: 1 s}}
components:
  left: {{type: "soak_parts:Lag", step: {_STEP}}}
  right: {{type: "soak_parts:Lag", step: {_STEP}}}
connections:
  - {{from: left.x, to: right.u}}
  - {{from: right.x, to: left.u}}
"""

_CAMPAIGN: Final = """\
schema: 1
scenario: SCENARIO
seeds: 1
set: {time.stop: 2 s}
metrics: {prr: measures.prr.prr, age: measures.aoi.aoi_mean_ms}
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class Soak:
    """A long run, or many short ones that one process makes for an experiment.

    Attributes:
        kind: its row in the table.
        stop: simulated time [s]; of an experiment the number of its runs.
        scenario: of a package; empty for the cheap one, and for an experiment.
        is_experiment: whether it is one.
        repeated: whether it is run twice, for its fingerprint.
        values: that are recorded; 0 if nobody counted them.
    """

    kind: str
    stop: float
    scenario: str = ""
    is_experiment: bool = False
    repeated: bool = False
    values: int = 0


def _cheap(steps: int) -> Soak:
    return Soak(kind=f"{steps:,} steps", stop=steps / 1e3, repeated=True, values=2 * steps)


SOAKS: Final = (
    _cheap(20_000),
    Soak(kind="10 s of red_light", stop=10, scenario="red_light"),
    Soak(kind="20 runs of an experiment", stop=20, is_experiment=True),
    _cheap(1_000_000),
    Soak(kind="10 minutes of red_light", stop=600, scenario="red_light"),
    Soak(kind="100 runs of an experiment", stop=100, is_experiment=True),
)
"""The first three are the small campaign."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Sample:
    """What a run took when somebody looked.

    Attributes:
        time: simulated [s]; of an experiment the number of runs that are done.
        usage: of its processes.
    """

    time: float
    usage: Usage


def complaints(samples: Sequence[Sample], stop: float) -> list[str]:
    """What the second half of a run took that it should not.

    The first tenth, in which libraries are loaded, and the end, when the recording is looked at,
    are left out.
    """
    first = [s for s in samples if 0.1 * stop <= s.time < 0.5 * stop]
    second = [s for s in samples if 0.5 * stop <= s.time < 0.98 * stop]
    if len(first) < _FEWEST or len(second) < _FEWEST:
        return [f"it was looked at {len(first)} and {len(second)} times only"]
    found = []
    growth = _memory(second) - _memory(first)
    if growth > GROWTH_MB * _MEGABYTE:
        found.append(f"{growth / _MEGABYTE:.0f} MB more in the second half")
    last = second[len(second) // 2 :]  # a file that is open for a moment is no leak
    files = min(s.usage.files for s in last) - max(s.usage.files for s in first)
    if files > 0:
        found.append(f"{files} open files more in the second half")
    before, after = _rate(first), _rate(second)
    if (after - SLOWER * before) * stop / 2 > _NOTICEABLE:
        found.append(f"a step takes {after / before:.1f} times as long in the second half")
    return found


def confirmed(found: Sequence[str], again: Callable[[], Sequence[str]]) -> list[str]:
    """Those complaints that another run gives cause for, too, whatever their numbers are.

    What a leak takes it takes every time. The most memory of some runs varies by 10 MB from one
    time to the next (standard deviation of 14 times 20 runs), as the allocator has it.

    Args:
        found: the complaints about the first run.
        again: makes the other run if there is something to confirm; its complaints.
    """
    if not found:
        return []
    others = {_without_numbers(each) for each in again()}
    return [each for each in found if _without_numbers(each) in others]


def _without_numbers(complaint: str) -> str:
    return re.sub(r"[0-9.]+", "", complaint)


def _memory(samples: Sequence[Sample]) -> int:
    return max(s.usage.memory for s in samples)


def _rate(samples: Sequence[Sample]) -> float:
    """Processor time per simulated time."""
    first, last = samples[0], samples[-1]
    return (last.usage.processor - first.usage.processor) / max(last.time - first.time, 1e-9)


def _command(soak: Soak, folder: Path, name: str) -> list[str]:
    nlosim = [sys.executable, "-m", "orchestrator"]
    if soak.is_experiment:
        scenario = json.dumps(str(installed_scenario("red_light").path))
        (folder / "campaign.yaml").write_text(_CAMPAIGN.replace("SCENARIO", scenario))
        command = [*nlosim, "experiment", "campaign.yaml", "--seeds", f"1..{soak.stop:g}"]
        return [*command, "--workers", "1", "--quiet", "--no-page", "--out", name]
    scenario = soak.scenario
    if not scenario:
        shutil.copy(Path(__file__).with_name("soak_parts.py"), folder)
        (folder / "cheap.yaml").write_text(_CHEAP)
        scenario = "cheap.yaml"
    command = [*nlosim, "run", scenario, "--quiet", "--out", name]
    return [*command, "--set", f"time.stop={soak.stop:g}s", "--no-page", "--no-figure"]


def reached(soak: Soak, directory: Path) -> float | None:
    """How far it is, as `Sample.time`."""
    if not soak.is_experiment:
        now = called(directory)
        return None if now is None else now.time / 1e9
    try:
        return float((directory / "runs.jsonl").read_bytes().count(b"\n"))
    except FileNotFoundError:
        return None


def _run(soak: Soak, folder: Path, name: str) -> tuple[list[Sample], int, str]:
    """What a run took, its exit code and its last words."""
    command = _command(soak, folder, name)
    samples = []
    with (folder / "words").open("w+") as words:
        begin = monotonic()
        process = subprocess.Popen(command, cwd=folder, stdout=words, stderr=words)
        while process.poll() is None:
            now = reached(soak, folder / name)
            if now is not None:
                samples.append(Sample(time=now, usage=usage(process.pid)))
            age = monotonic() - begin
            if age > _LONGEST:
                process.kill()
            sleep(min(_LOOK, age / 100))
        words.seek(0)
        last = words.read().splitlines()[-1:]
    return samples, process.returncode, "".join(last)


def _recorded(directory: Path) -> int:
    """What the signals take on disk [byte]."""
    return sum(f.stat().st_size for f in (directory / "signals").rglob("*") if f.is_file())


def _fingerprint(directory: Path) -> str:
    found: str = json.loads((directory / "manifest.json").read_text())["fingerprint"]
    return found


def _perform(soak: Soak, case: int) -> Outcome:
    begin, found = monotonic(), []
    with tempfile.TemporaryDirectory(prefix="nlosim-soak-") as path:
        folder = Path(path)
        samples, code, last = _run(soak, folder, "run")
        seconds = monotonic() - begin
        if code:
            found.append(f"exit code {code}: {last}")
        else:
            found += confirmed(
                complaints(samples, soak.stop),
                lambda: complaints(_run(soak, folder, "confirming")[0], soak.stop),
            )
            room = soak.values * BYTES_PER_VALUE + _OVERHEAD_MB * _MEGABYTE
            if soak.values and _recorded(folder / "run") > room:
                found.append(f"{_recorded(folder / 'run')} bytes are recorded")
            if soak.repeated:
                _run(soak, folder, "again")
                if _fingerprint(folder / "run") != _fingerprint(folder / "again"):
                    found.append("the fingerprint is another one when it is repeated")
    return Outcome(
        case=case,
        kind=soak.kind,
        is_expected=not found,
        why="; ".join(found),
        seconds=seconds,
        peak_mb=max((s.usage.memory for s in samples), default=0) / _MEGABYTE,
    )


def _some(_seed: int, numbers: Sequence[int]) -> Iterator[Outcome]:
    for case in numbers:
        yield _perform(SOAKS[case % len(SOAKS)], case)


SOAK: Final = of_cases(
    "soak",
    "long runs: two cheap components for a million steps, ten simulated minutes of a shipped "
    "scenario with SUMO, a hundred runs of an experiment in one process; memory, open files and "
    "processor time of the second half are those of the first one, the recording is as large as "
    "its values, and a repetition has its fingerprint",
    full=len(SOAKS),
    small=3,
    some=_some,
    needs="" if sys.platform == "linux" else "only Linux tells what other processes take",
)
