"""Conducting an experiment: what is not done yet is run, and everything done is written."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from typing_extensions import override

from orchestrator.campaign.conduct import Campaign, Options, conduct, perform_all
from orchestrator.campaign.journal import ResumeError
from orchestrator.campaign.work import Result, RunKey, Work
from orchestrator.campaign.workers import require
from orchestrator.errors import defects
from orchestrator.experiment import findings, tables
from orchestrator.experiment.journal import Journal
from orchestrator.experiment.page.kept import KEPT, name
from orchestrator.experiment.page.page import make_page
from orchestrator.experiment.plan import Experiment
from orchestrator.experiment.report import ExperimentFindings


@dataclass(frozen=True, slots=True, kw_only=True)
class ExperimentOutcome:
    """What an experiment came to.

    Attributes:
        directory: of the results.
        runs: how many there are results of.
        summary: one row per combination.
        units: of metrics, as far as they have one.
        failed: runs that failed twice, and why.
        report: what the report says; of one that failed, nothing.
        report_error: why the report, or the page, could not be made.
        page: `index.html`, if it was wanted.
    """

    directory: Path
    runs: int
    summary: list[dict[str, Any]]
    units: Mapping[str, str]
    failed: dict[RunKey, str]
    report: ExperimentFindings
    report_error: BaseException | None
    page: Path | None


def conduct_experiment(
    experiment: Experiment, options: Options, *, keep_runs: bool = False, page: bool = True
) -> ExperimentOutcome:
    """Run what is not done yet, and write journal, tables, report and page.

    Args:
        experiment: what to run.
        options: how.
        keep_runs: whether run directories are kept.
        page: whether `index.html` is written, to look at the runs in a browser.

    Raises:
        MissingExtraError: Dask or pyarrow is not installed.
        RecordingError, ResumeError: the directory cannot be used.
        ScenarioError: the runs do not have the metrics that the experiment file names.
        Interrupted: after Ctrl-C; what was done is written.
        StoppedShortError: a file could not be written or read.
    """
    for module in ("distributed", "pyarrow.parquet"):
        require(module)
    return conduct(_Runs(experiment, options, keep_runs, page), options)


@dataclass(frozen=True, slots=True)
class _Runs(Campaign[Journal, ExperimentOutcome]):
    """The runs of an experiment."""

    experiment: Experiment
    options: Options
    keep_runs: bool
    page: bool

    @property
    @override
    def name(self) -> str:
        return self.experiment.path.stem

    @override
    def begin(self, directory: Path) -> Journal:
        return Journal.begin(directory, self.experiment, self.options.command)

    @override
    def resume(self, directory: Path) -> Journal:
        return Journal.resume(directory, self.experiment, self.options.command)

    @override
    def work(self, directory: Path, journal: Journal) -> None:
        for result in journal.results.values():
            tables.selected(self.experiment, result.metrics)  # a metric may be new, and misspelt
        missing = [key for key in self.experiment.runs() if key not in journal.results]
        if not missing:
            return
        repeated = journal.of_combinations({key.combination for key in missing})
        kept = directory / KEPT if self.keep_runs else None
        work = [(key, _work(self.experiment, key, None)) for key in repeated]
        work += [(key, _work(self.experiment, key, kept)) for key in missing]

        def note(key: RunKey, result: Result) -> None:
            if key in repeated:
                _compare(self.experiment, directory, key, journal.results[key], result)
                return
            journal.add((key, result))
            if result.error is None:
                tables.selected(self.experiment, result.metrics)  # refuses a misspelt one

        with self.options.pool() as workers:
            perform_all(work, workers, note, self.options, done=len(journal.results))

    @override
    def outcome(self, directory: Path, journal: Journal) -> ExperimentOutcome:
        summary = findings.write_tables(directory)
        report, report_error = ExperimentFindings(tables={}, text=""), None
        try:
            report = findings.make_report(directory)
        except defects() as error:  # the results are there, whatever a report does
            report_error = error
        page: Path | None = None
        try:
            page = make_page(directory) if self.page else None
        except defects() as error:  # likewise
            report_error = report_error or error
        return ExperimentOutcome(
            directory=directory,
            runs=len(journal.results),
            summary=summary.rows,
            units=summary.units,
            failed={k: r.error for k, r in sorted(journal.results.items()) if r.error is not None},
            report=report,
            report_error=report_error,
            page=page,
        )


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


def _work(experiment: Experiment, key: RunKey, kept: Path | None) -> Work:
    combination = experiment.combinations[key.combination]
    return Work(
        scenario=str(experiment.scenario),
        overrides=(*combination.overrides, f"seed={key.seed}"),
        keep=None if kept is None else str((kept / name(key.combination, key.seed)).absolute()),
        scratch=None,
        transport=experiment.transport,
        hosts=None if experiment.hosts is None else str(experiment.hosts),
        private=experiment.private,
    )
