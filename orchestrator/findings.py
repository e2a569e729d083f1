"""The files that a report leaves in a run directory."""

import csv
import json
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

import numpy as np

from orchestrator.measure import Answer, Measure, Table
from orchestrator.recording.layout import write_json
from orchestrator.recording.reader import Recording
from orchestrator.report import report_type

METRICS: Final = "metrics.json"
FIGURE: Final = "figure.png"
TABLES: Final = "measures"
PANELS: Final = "measures.png"


@dataclass(frozen=True, slots=True)
class Findings:
    """What a report and measures say about one run.

    Attributes:
        metrics: by name; those of measures under `measures`, by the name of each.
        summary: lines for the terminal.
        files: what was written, the metrics first.
    """

    metrics: Mapping[str, Any]
    summary: str
    files: tuple[Path, ...]


def make_report(
    name: str | None, measures: Mapping[str, Measure], directory: Path, *, figure: bool
) -> Findings:
    """Ask a report and measures about the recording in `directory`; write what they found.

    Metrics go to `metrics.json`, tables of measures to `measures/`, the figure of the report to
    `figure.png` and the panels of measures to `measures.png`.

    Args:
        name: of an installed report, or `None`.
        measures: by the name that the metrics are to have.
        directory: of a run.
        figure: whether report and measures are to draw.

    Raises:
        ComponentTypeError: the report cannot be loaded.
        RecordingError: there is no recording.
        Exception: whatever the report or a measure raises; a note on it names the measure.
    """
    recording = Recording(directory)
    report = None if name is None else report_type(name)()
    found = {} if report is None else dict(report.metrics(recording))
    answers = {label: _asked(label, each, recording) for label, each in measures.items()}
    if measures:
        found["measures"] = {label: answer.numbers for label, answer in answers.items()}
    # through JSON and back, so that everybody sees what a reader of the file will see
    metrics = json.loads(json.dumps(found, allow_nan=False))
    write_json(directory / METRICS, metrics)
    files = [directory / METRICS, *_write_tables(answers, directory / TABLES)]
    panels = {label: each.panel for label, each in answers.items() if each.panel is not None}
    if figure and report is not None:
        report.figure(recording, metrics, directory / FIGURE)
        files.append(directory / FIGURE)
    if figure and panels:
        from orchestrator.drawing import draw_panels  # noqa: PLC0415 - matplotlib is slow to load

        draw_panels(panels, directory / PANELS)
        files.append(directory / PANELS)
    summary = "" if report is None else report.summary(metrics, recording.manifest)
    lines = "\n".join(filter(None, [summary, _lines(metrics)]))
    return Findings(metrics, lines, tuple(files))


def _asked(label: str, measure: Measure, recording: Recording) -> Answer:
    try:
        found = measure.compute(recording)
        answer = found if isinstance(found, Answer) else Answer(numbers=found)
        return replace(answer, numbers=_finite(answer.numbers))
    except Exception as error:
        error.add_note(f"measure `{label}`")
        raise


def _write_tables(answers: Mapping[str, Answer], folder: Path) -> Iterator[Path]:
    """Write the tables of all measures; yields the files."""
    for label, answer in answers.items():
        for name, table in answer.tables.items():
            folder.mkdir(exist_ok=True)
            path = folder / f"{label}-{name}.csv"
            _write_table(table, path)
            yield path


def _write_table(table: Table, path: Path) -> None:
    columns = [np.asarray(column).tolist() for column in table.values()]
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(table)
        writer.writerows(map(_fields, zip(*columns, strict=True)))


def _fields(row: tuple[Any, ...]) -> list[Any]:
    return ["" if isinstance(each, float) and math.isnan(each) else each for each in row]


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
