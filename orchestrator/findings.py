"""The files that a report leaves in a run directory."""

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from orchestrator.measure import Measure
from orchestrator.recording.layout import write_json
from orchestrator.recording.reader import Recording
from orchestrator.report import report_type

METRICS: Final = "metrics.json"
FIGURE: Final = "figure.png"


@dataclass(frozen=True, slots=True)
class Findings:
    """What a report and measures say about one run.

    Attributes:
        metrics: by name; those of measures under `measures`, by the name of each.
        summary: lines for the terminal.
    """

    metrics: Mapping[str, Any]
    summary: str


def make_report(
    name: str | None, measures: Mapping[str, Measure], directory: Path, *, figure: bool
) -> Findings:
    """Ask a report and measures about the recording in `directory`; write metrics and a figure.

    Args:
        name: of an installed report, or `None`.
        measures: by the name that the metrics are to have.
        directory: of a run.
        figure: whether the report is to draw.

    Raises:
        ComponentTypeError: the report cannot be loaded.
        RecordingError: there is no recording.
        Exception: whatever the report or a measure raises; a note on it names the measure.
    """
    recording = Recording(directory)
    report = None if name is None else report_type(name)()
    found = {} if report is None else dict(report.metrics(recording))
    if measures:
        found["measures"] = {
            label: _asked(label, each, recording) for label, each in measures.items()
        }
    # through JSON and back, so that everybody sees what a reader of the file will see
    metrics = json.loads(json.dumps(found, allow_nan=False))
    write_json(directory / METRICS, metrics)
    if report is None:
        return Findings(metrics, _lines(metrics))
    if figure:
        report.figure(recording, metrics, directory / FIGURE)
    summary = report.summary(metrics, recording.manifest)
    return Findings(metrics, "\n".join(filter(None, [summary, _lines(metrics)])))


def _asked(label: str, measure: Measure, recording: Recording) -> Mapping[str, Any]:
    try:
        return _finite(measure.compute(recording))
    except Exception as error:
        error.add_note(f"measure `{label}`")
        raise


def _finite(found: Mapping[str, Any]) -> Mapping[str, Any]:
    """`found`, unless there is no number where one is said to be."""
    for key, value in found.items():
        if isinstance(value, float) and not math.isfinite(value):
            raise ArithmeticError(f"`{key}` is {value}; `None` is for what cannot be said")
    return dict(found)


def _lines(metrics: Mapping[str, Any]) -> str:
    """What the measures found, for the terminal: a line for each."""
    return "\n".join(
        f"{label}: {', '.join(f'{key} {_spell(value)}' for key, value in found.items())}"
        for label, found in metrics.get("measures", {}).items()
    )


def _spell(value: object) -> str:
    return f"{value:.6g}" if isinstance(value, float) else "-" if value is None else str(value)
