"""One run of an experiment, as a worker performs it: plain values in, plain values out."""

import tempfile
import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from orchestrator.run import RunInterrupted, new_directory, run_scenario
from orchestrator.scenario.build import load_scenario


@dataclass(frozen=True, slots=True, kw_only=True)
class Work:
    """What a worker has to know.

    Attributes:
        scenario: the absolute path of the scenario file.
        overrides: as `nlosim run --set` takes them, the seed among them.
        keep: the run directory to create (numbered if it exists); `None` keeps nothing.
        scratch: where to run if nothing is kept; `None`: the worker's temporary directory.
    """

    scenario: str
    overrides: tuple[str, ...]
    keep: str | None
    scratch: str | None


@dataclass(frozen=True, slots=True, kw_only=True)
class Result:
    """What became of a run.

    Attributes:
        wall: how long it took, start and report included [s].
        fingerprint: of the recording; `None` if the run failed.
        metrics: all of the scenario's report; empty if the run failed.
        error: why it failed, or `None`.
    """

    wall: float
    fingerprint: str | None
    metrics: Mapping[str, Any]
    error: str | None


def perform(work: Work) -> Result:
    """Run; errors become results, because not every exception survives the way back."""
    begin = time.perf_counter()
    try:
        fingerprint, metrics = _run(work)
    except (Exception, RunInterrupted) as error:
        reason = str(error) or type(error).__name__
        wall = time.perf_counter() - begin
        return Result(wall=wall, fingerprint=None, metrics={}, error=reason)
    wall = time.perf_counter() - begin
    return Result(wall=wall, fingerprint=fingerprint, metrics=metrics, error=None)


def _run(work: Work) -> tuple[str, Mapping[str, Any]]:
    scenario = load_scenario(Path(work.scenario), work.overrides)
    if work.keep is not None:
        keep = Path(work.keep)
        outcome = run_scenario(scenario, new_directory(keep.parent, keep.name), figure=False)
        return outcome.fingerprint, outcome.metrics
    with tempfile.TemporaryDirectory(dir=work.scratch, prefix="nlosim-run-") as directory:
        outcome = run_scenario(scenario, Path(directory), figure=False)
    return outcome.fingerprint, outcome.metrics
