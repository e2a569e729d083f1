"""`nlosim report`."""

from argparse import Namespace
from collections.abc import Sequence
from pathlib import Path

from orchestrator.cli.outcome import Exit, Outcome, failure
from orchestrator.errors import CosimError
from orchestrator.experiment import findings as experiment_findings
from orchestrator.experiment.stored import is_experiment
from orchestrator.findings import make_report
from orchestrator.recording.crash import is_crash
from orchestrator.recording.reader import Recording
from orchestrator.scenario.measures import questions_of
from orchestrator.table_files import Format


def execute(arguments: Namespace) -> Outcome:
    """Make tables and figures of a finished run or experiment again."""
    directory = Path(arguments.directory)
    if is_experiment(directory):
        return _of_experiment(directory)
    more = [name.strip() for name in (arguments.measures or "").split(",") if name.strip()]
    return _of_run(directory, more, ["csv", "parquet"] if arguments.parquet else None)


def _of_run(directory: Path, more: Sequence[str], tables: Sequence[Format] | None) -> Outcome:
    recording = Recording(directory)
    manifest, faults = recording.manifest, recording.faults()
    scenario = manifest.get("scenario", {})
    asked = questions_of(scenario, more=more, tables=tables)
    if asked.report is None and not asked.measures and not asked.optional:
        raise CosimError(
            f"the scenario of `{directory}` names no report, and wants no measures; "
            "`--measures all` asks them anyway"
        )
    findings = make_report(asked, directory, figure=True, damaged=bool(faults))
    crash = [f"the run ended early: {manifest['error']}", ""] if is_crash(manifest) else []
    lines = [*crash, findings.summary.rstrip(), "", f"wrote {', '.join(map(str, findings.files))}"]
    text = "\n".join(lines).lstrip("\n")
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
    return Outcome(text=text, data={"out": str(directory), "metrics": dict(findings.metrics)})


def _of_experiment(directory: Path) -> Outcome:
    summary = experiment_findings.write_tables(directory)
    try:
        findings = experiment_findings.make_report(directory)
    except ValueError as error:
        return failure("report", Exit.WRONG_INPUT, f"the report cannot be made: {error}")
    written = sorted(str(path) for path in (directory / experiment_findings.REPORT).glob("*"))
    files = [str(directory / "runs.parquet"), str(directory / "summary.csv"), *written]
    return Outcome(
        text="\n".join([findings.text.rstrip(), "", f"wrote {', '.join(files)}"]).lstrip("\n"),
        data={"out": str(directory), "tables": {**findings.tables, "summary": summary.rows}},
    )
