"""The files that a report leaves in a run directory."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from orchestrator.recording.layout import write_json
from orchestrator.recording.reader import Recording
from orchestrator.report import report_type

METRICS: Final = "metrics.json"
FIGURE: Final = "figure.png"


@dataclass(frozen=True, slots=True)
class Findings:
    """What a report says about one run.

    Attributes:
        metrics: by name; empty without a report.
        summary: lines for the terminal; empty without a report.
    """

    metrics: Mapping[str, Any]
    summary: str


def make_report(name: str | None, directory: Path, *, figure: bool) -> Findings:
    """Apply a report to the recording in `directory` and write its metrics and its figure.

    Args:
        name: of an installed report; `None` writes empty metrics.
        directory: of a run.
        figure: whether to draw.

    Raises:
        ComponentTypeError: the report cannot be loaded.
        RecordingError: there is no recording.
        Exception: whatever the report raises.
    """
    recording = Recording(directory)
    if name is None:
        write_json(directory / METRICS, {})
        return Findings({}, "")
    report = report_type(name)()
    # through JSON and back, so that everybody sees what a reader of the file will see
    metrics = json.loads(json.dumps(report.metrics(recording), allow_nan=False))
    write_json(directory / METRICS, metrics)
    if figure:
        report.figure(recording, metrics, directory / FIGURE)
    return Findings(metrics, report.summary(metrics, recording.manifest))
