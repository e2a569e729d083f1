"""Conducting an experiment: what is not done yet is run, and everything done is written."""

import contextlib
import shutil
import sys
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from tqdm import tqdm

from orchestrator.experiment import findings, tables
from orchestrator.experiment.journal import Journal, ResumeError
from orchestrator.experiment.plan import Experiment, RunKey
from orchestrator.experiment.report import ExperimentFindings
from orchestrator.experiment.work import Result, Work
from orchestrator.experiment.workers import Workers, local_workers, require, scheduled_workers
from orchestrator.run import claim_directory, new_directory

KEPT: Final = "runs"
"""The folder of the run directories, if they are kept."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Options:
    """How to conduct an experiment.

    Attributes:
        out: the directory of the results; `None`: `runs/<experiment>`, numbered.
        workers: number of processes; `None`: one per core.
        scheduler: the address of a Dask scheduler instead of processes of our own.
        resume: whether to go on in `out`.
        keep_runs: whether run directories are kept.
        progress: whether to draw a bar.
        command: how the user began this, for the record.
        check: called after every run; raises `KeyboardInterrupt` if the user asked to stop.
    """

    out: Path | None
    workers: int | None
    scheduler: str | None
    resume: bool
    keep_runs: bool
    progress: bool
    command: str
    check: Callable[[], None]


@dataclass(frozen=True, slots=True, kw_only=True)
class ExperimentOutcome:
    """What an experiment came to.

    Attributes:
        directory: of the results.
        runs: how many there are results of.
        summary: one row per combination.
        failed: runs that failed twice, and why.
        report: what the report says; of one that failed, nothing.
        report_error: why the report could not be made.
    """

    directory: Path
    runs: int
    summary: list[dict[str, Any]]
    failed: dict[RunKey, str]
    report: ExperimentFindings
    report_error: Exception | None


class ExperimentInterrupted(KeyboardInterrupt):
    """An experiment was interrupted from outside.

    Attributes:
        outcome: of the runs done until then; they are written.
    """

    def __init__(self, outcome: ExperimentOutcome) -> None:
        super().__init__("interrupted")
        self.outcome = outcome


def conduct(experiment: Experiment, options: Options) -> ExperimentOutcome:
    """Run what is not done yet, and write journal, tables and report.

    Raises:
        MissingExtraError: Dask or pyarrow is not installed.
        RecordingError, ResumeError: the directory cannot be used.
        ScenarioError: the runs do not have the metrics that the experiment file names.
        ExperimentInterrupted: after Ctrl-C; what was done is written.
    """
    for module in ("distributed", "pyarrow.parquet"):
        require(module)
    directory, journal = _journal(experiment, options)
    with contextlib.closing(journal):
        for result in journal.results.values():
            tables.selected(experiment, result.metrics)  # a metric may be new, and misspelt
        try:
            _run(experiment, options, directory, journal)
        except KeyboardInterrupt:
            raise ExperimentInterrupted(_write(directory, journal)) from None
        return _write(directory, journal)


def _journal(experiment: Experiment, options: Options) -> tuple[Path, Journal]:
    if options.resume and options.out is not None:
        return options.out, Journal.resume(options.out, experiment, options.command)
    if options.out is None:
        directory = new_directory(Path("runs"), experiment.path.stem)
    else:
        directory = claim_directory(options.out)
    return directory, Journal.begin(directory, experiment, options.command)


def _run(experiment: Experiment, options: Options, directory: Path, journal: Journal) -> None:
    missing = [key for key in experiment.runs() if key not in journal.results]
    if not missing:
        return
    repeated = journal.of_combinations({key.combination for key in missing})
    with _workers(options) as (workers, scratch):
        work = [(key, _work(experiment, key, None, scratch)) for key in repeated]
        kept = directory / KEPT if options.keep_runs else None
        work += [(key, _work(experiment, key, kept, scratch)) for key in missing]
        bar = tqdm(
            total=len(work) + len(journal.results),
            initial=len(journal.results),
            file=sys.stderr,
            unit=" runs",
            smoothing=0.0,  # runs take turns and cost differently: the mean says what is left
            disable=not options.progress,
        )
        with bar, contextlib.closing(workers.results(work)) as results:
            for key, result in results:
                bar.update()
                if key in repeated:
                    _compare(experiment, directory, key, journal.results[key], result)
                else:
                    journal.add(key, result)
                    if result.error is None:
                        tables.selected(experiment, result.metrics)  # refuses a misspelt one
                options.check()


def _compare(
    experiment: Experiment, directory: Path, key: RunKey, former: Result, result: Result
) -> None:
    """Refuse to put runs into one table that the same files would not give any more."""
    if result.fingerprint == former.fingerprint:
        return
    now = f"fails now: {result.error}" if result.error else f"is {result.fingerprint} now"
    raise ResumeError(
        f"`{directory}` holds runs that come out differently now: the recording of "
        f"{experiment.name(key)} had the fingerprint {former.fingerprint}, and {now}. Code, "
        "libraries or a file that a component reads have changed since; go back to them, or "
        "choose another --out, without --resume"
    )


@contextlib.contextmanager
def _workers(options: Options) -> Iterator[tuple[Workers, Path | None]]:
    """The workers, and where those of this machine may write."""
    if options.scheduler is not None:
        with scheduled_workers(options.scheduler) as workers:
            yield workers, None
        return
    scratch = Path(tempfile.mkdtemp(prefix="nlosim-experiment-"))
    try:
        with local_workers(options.workers, scratch) as workers:
            yield workers, scratch
    finally:
        shutil.rmtree(scratch, ignore_errors=True)


def _work(experiment: Experiment, key: RunKey, kept: Path | None, scratch: Path | None) -> Work:
    combination = experiment.combinations[key.combination]
    name = "-".join([str(key.combination + 1), f"seed-{key.seed}"])
    return Work(
        scenario=str(experiment.scenario),
        overrides=(*combination.overrides, f"seed={key.seed}"),
        keep=None if kept is None else str((kept / name).absolute()),
        scratch=None if scratch is None else str(scratch),
    )


def _write(directory: Path, journal: Journal) -> ExperimentOutcome:
    summary = findings.write_tables(directory)
    report, report_error = ExperimentFindings(tables={}, text=""), None
    try:
        report = findings.make_report(directory)
    except Exception as error:  # the results are there, whatever a report does
        report_error = error
    return ExperimentOutcome(
        directory=directory,
        runs=len(journal.results),
        summary=summary,
        failed={k: r.error for k, r in sorted(journal.results.items()) if r.error is not None},
        report=report,
        report_error=report_error,
    )
