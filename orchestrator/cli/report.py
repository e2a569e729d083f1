"""`nlosim report`."""

from argparse import Namespace
from pathlib import Path

from orchestrator.cli.outcome import Outcome
from orchestrator.errors import CosimError
from orchestrator.findings import FIGURE, METRICS, make_report
from orchestrator.recording.reader import Recording


def execute(arguments: Namespace) -> Outcome:
    """Compute metrics and figure of a finished run again."""
    directory = Path(arguments.directory)
    name = Recording(directory).manifest.get("scenario", {}).get("report")
    if name is None:
        raise CosimError(f"the scenario of `{directory}` names no report")
    findings = make_report(name, directory, figure=True)
    lines = [findings.summary.rstrip(), "", f"wrote {directory / METRICS}, {directory / FIGURE}"]
    return Outcome(
        text="\n".join(lines).lstrip("\n"),
        data={"out": str(directory), "metrics": dict(findings.metrics)},
    )
