"""`nlosim report`."""

from argparse import Namespace
from collections.abc import Sequence
from pathlib import Path
from typing import Final

from orchestrator.cli.failures import plugin_failed
from orchestrator.cli.fitting import fitted
from orchestrator.cli.outcome import Exit, Outcome, failure
from orchestrator.errors import CosimError, PluginError
from orchestrator.experiment import findings as experiment_findings
from orchestrator.experiment.page.page import make_joint_page, make_page as make_experiment_page
from orchestrator.experiment.stored import is_experiment
from orchestrator.findings import METRICS, NotAnsweredError, make_report
from orchestrator.page.page import make_page
from orchestrator.recording.crash import is_crash
from orchestrator.recording.reader import Recording
from orchestrator.scenario.measures import questions_of
from orchestrator.table_files import Format

_NOTHING_ASKED: Final = (
    "the scenario names no report, and wants no measures; `--measures all` asks them anyway"
)


def execute(arguments: Namespace) -> Outcome:
    """Make tables and figures of a finished run or experiment again."""
    if arguments.page is not None or len(arguments.directory) > 1:
        return _joint_page(list(map(Path, arguments.directory)), arguments.page)
    directory = Path(arguments.directory[0])
    if is_experiment(directory):
        return _of_experiment(directory)
    more = [name.strip() for name in (arguments.measures or "").split(",") if name.strip()]
    return _of_run(directory, more, ["csv", "parquet"] if arguments.parquet else None)


def _joint_page(directories: Sequence[Path], page: str | None) -> Outcome:
    """One page of several experiments; nothing else is written."""
    if page is None:
        raise CosimError("several directories need --page FILE, where the page of them all goes")
    path = Path(page)
    try:
        make_joint_page(directories, path)
    except OSError as error:
        raise CosimError(f"`{path}` cannot be written: {error.strerror}") from error
    return Outcome(text=f"wrote {path}", data={"page": str(path)})


def _of_run(directory: Path, more: Sequence[str], tables: Sequence[Format] | None) -> Outcome:
    recording = Recording(directory)
    manifest, faults = recording.manifest, recording.faults()
    scenario = manifest.get("scenario", {})
    asked = questions_of(scenario, more=more, tables=tables)
    try:
        findings = make_report(asked, directory, figure=True, damaged=bool(faults))
    except NotAnsweredError as error:
        page, out = make_page(directory), str(directory)
        rest = f"what the others found is in {directory / METRICS} and {page}"
        if error.says_why:
            return failure("report", Exit.WRONG_INPUT, f"{error}; {rest}", out=out)
        return plugin_failed(error, None, f"{error}; {rest}")
    files = [*findings.files, make_page(directory)]
    crash = [f"the run ended early: {manifest['error']}", ""] if is_crash(manifest) else []
    nothing = asked.report is None and not asked.measures and not asked.optional
    hint = [_NOTHING_ASKED, ""] if nothing else []
    biased = [f"biased: {each}" for each in manifest.get("cautions", ())]
    lines = [
        *crash,
        *hint,
        findings.summary.rstrip(),
        "",
        *biased,
        f"wrote {', '.join(map(str, files))}",
    ]
    text = fitted("\n".join(lines).lstrip("\n"))
    if faults:
        noun = "place" if len(faults) == 1 else "places"
        return failure(
            "damage",
            Exit.WRONG_INPUT,
            f"the recording is damaged in {len(faults)} {noun}",
            text="\n".join([*(f"error: {fault}" for fault in faults), "", "of the rest:", text]),
            faults=list(faults),
            out=str(directory),
            metrics=dict(findings.metrics),
        )
    return Outcome(
        text=text,
        data={"out": str(directory), "page": str(files[-1]), "metrics": dict(findings.metrics)},
    )


def _of_experiment(directory: Path) -> Outcome:
    summary = experiment_findings.write_tables(directory)
    try:
        findings = experiment_findings.make_report(directory)
    except (ValueError, PluginError) as error:
        make_experiment_page(directory)  # whatever becomes of the report
        if isinstance(error, PluginError):
            raise
        return failure("report", Exit.WRONG_INPUT, f"the report cannot be made: {error}")
    page = make_experiment_page(directory)
    written = sorted(str(path) for path in (directory / experiment_findings.REPORT).glob("*"))
    files = [str(directory / "runs.parquet"), str(directory / "summary.csv"), *written, str(page)]
    return Outcome(
        text="\n".join([findings.text.rstrip(), "", f"wrote {', '.join(files)}"]).lstrip("\n"),
        data={
            "out": str(directory),
            "page": str(page),
            "tables": {**findings.tables, "summary": summary.rows},
        },
    )
