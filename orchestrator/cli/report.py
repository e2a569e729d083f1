"""`nlosim report`."""

from argparse import Namespace
from pathlib import Path

from orchestrator.cli.outcome import Exit, Outcome, failure
from orchestrator.errors import CosimError
from orchestrator.experiment import findings as experiment_findings
from orchestrator.experiment.stored import is_experiment
from orchestrator.findings import make_report
from orchestrator.recording.reader import Recording
from orchestrator.scenario.measures import measures_of


def execute(arguments: Namespace) -> Outcome:
    """Make tables and figures of a finished run or experiment again."""
    directory = Path(arguments.directory)
    return _of_experiment(directory) if is_experiment(directory) else _of_run(directory)


def _of_run(directory: Path) -> Outcome:
    scenario = Recording(directory).manifest.get("scenario", {})
    name, measures = scenario.get("report"), measures_of(scenario.get("measures", {}))
    if name is None and not measures:
        raise CosimError(f"the scenario of `{directory}` names neither a report nor measures")
    findings = make_report(name, measures, directory, figure=True)
    lines = [findings.summary.rstrip(), "", f"wrote {', '.join(map(str, findings.files))}"]
    return Outcome(
        text="\n".join(lines).lstrip("\n"),
        data={"out": str(directory), "metrics": dict(findings.metrics)},
    )


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
        data={"out": str(directory), "tables": {**findings.tables, "summary": summary}},
    )
