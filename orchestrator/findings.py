"""The files that a report leaves in a run directory."""

import json
import math
from collections.abc import Collection, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

import numpy as np

from orchestrator.measure import Answer, Measure, Panel
from orchestrator.questions import Questions
from orchestrator.recording.layout import RecordingError, write_json
from orchestrator.recording.reader import Recording
from orchestrator.table_files import Blocks, Table, chosen, write_tables

METRICS: Final = "metrics.json"
FIGURE: Final = "figure.png"
TABLES: Final = "measures"
PANELS: Final = "measures"
"""The name of the page, without suffix."""
LEFT_OUT: Final = "measures_left_out"
"""The key of `metrics.json` under which it is said why a measure was not asked."""

_BRIEF: Final = 4
"""Numbers of a measure that nobody has named, on the terminal; all are in `metrics.json`."""


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
    asked: Questions, directory: Path, *, figure: bool, damaged: bool = False
) -> Findings:
    """Ask a report and measures about the recording in `directory`; write what they found.

    Metrics go to `metrics.json`, tables of measures to `measures/`, the figure of the report to
    `figure.png` and the panels of measures to the page `measures.svg`.

    Args:
        asked: what is to be answered.
        directory: of a run.
        figure: whether report and measures are to draw.
        damaged: whether the recording is known to be; then what cannot be said is left out.

    Raises:
        RecordingError: there is no recording.
        MissingParquetError: Parquet was asked for, and pyarrow is not installed.
        Exception: whatever the report or a measure raises, unless the recording is damaged; a note
            on it names the measure.
    """
    formats = chosen(asked.tables)
    recording, report = Recording(directory), asked.report
    found: dict[str, Any] = {}
    left_out: dict[str, str] = {}
    if report is not None:
        with _left_out("report", left_out, damaged=damaged):
            found = dict(report.metrics(recording))
    answers = {}
    for label, each in asked.measures.items():
        with _left_out(label, left_out, damaged=damaged):
            answers[label] = _asked(label, each, recording)
    more, reasons = _optional(asked.optional, recording, damaged=damaged)
    answers |= more
    left_out |= reasons
    if answers:
        found["measures"] = {label: answer.numbers for label, answer in answers.items()}
    if left_out:
        found[LEFT_OUT] = left_out
    # through JSON and back, so that everybody sees what a reader of the file will see
    metrics = json.loads(json.dumps(found, allow_nan=False, default=_plain))
    write_json(directory / METRICS, metrics)
    tables: dict[str, Table | Blocks] = {}
    for label, answer in answers.items():
        tables |= {f"{label}-{name}": table for name, table in answer.tables.items()}
        tables |= {f"{label}-{name}": table for name, table in answer.long_tables.items()}
    files = [directory / METRICS, *write_tables(tables, directory / TABLES, formats)]
    panels = dict(_panels(answers))
    if "report" in left_out:
        report = None
    if figure and report is not None:
        with _left_out("figure", left_out, damaged=damaged):
            report.figure(recording, metrics, directory / FIGURE)
            files.append(directory / FIGURE)
    if figure and panels:
        from orchestrator.drawing import draw_panels  # noqa: PLC0415 - matplotlib is slow to load

        files.append(draw_panels(panels, directory / PANELS))
    summary = ""
    if report is not None:
        with _left_out("summary", left_out, damaged=damaged):
            summary = report.summary(metrics, recording.manifest)
    is_topic = any(asked.optional[label].signals() for label in more)
    lines = "\n".join(filter(None, [summary, *_lines(metrics, more, is_topic=is_topic)]))
    return Findings(metrics, lines, tuple(files))


def _panels(answers: Mapping[str, Answer]) -> Iterator[tuple[str, Panel]]:
    for label, answer in answers.items():
        if answer.panel is not None:
            yield label, answer.panel
        for name, panel in answer.panels.items():
            yield f"{label}: {name}", panel


@contextmanager
def _left_out(label: str, reasons: dict[str, str], *, damaged: bool) -> Iterator[None]:
    """Note why there is no `label`, if that is because the recording is damaged."""
    try:
        yield
    except Exception as error:  # whoever reads half a recording may stumble over anything
        if not damaged:
            raise
        lost = isinstance(error, RecordingError)
        reasons[label] = str(error) if lost else "not to be made of what is left"


def _optional(
    measures: Mapping[str, Measure], recording: Recording, *, damaged: bool
) -> tuple[dict[str, Answer], dict[str, str]]:
    """The answers that there are, and why there are no others."""
    answers: dict[str, Answer] = {}
    left_out: dict[str, str] = {}
    for label, measure in measures.items():
        missing = [f"`{name}`" for name in measure.signals() if name not in recording]
        if missing:
            left_out[label] = f"not recorded: {', '.join(missing)}"
            continue
        with _left_out(label, left_out, damaged=damaged):
            try:
                answers[label] = _asked(label, measure, recording)
            except (RecordingError, ValueError) as error:
                left_out[label] = str(error)
    return answers, left_out


def _asked(label: str, measure: Measure, recording: Recording) -> Answer:
    try:
        found = measure.compute(recording)
        answer = found if isinstance(found, Answer) else Answer(numbers=found)
        return replace(answer, numbers=_finite(answer.numbers))
    except Exception as error:
        error.add_note(f"measure `{label}`")
        raise


def _plain(value: object) -> object:
    """What is no number of Python as one, for `metrics.json`."""
    if isinstance(value, np.generic):
        return value.item()
    what = f"`{type(value).__name__}` cannot stand in {METRICS}; numbers, texts, lists of them can"
    raise TypeError(what)


def _finite(found: Any) -> dict[str, Any]:
    """`found` with numbers of Python, unless it has something else than numbers and texts."""
    if not isinstance(found, Mapping):
        kind = type(found).__name__
        raise TypeError(f"it gave `{kind}`, not an `Answer` or a mapping from names to numbers")
    plain = {}
    for key, value in found.items():
        known = value.item() if isinstance(value, np.generic) else value
        if not isinstance(known, bool | int | float | str | None):
            kind = type(known).__name__
            what = f"`{key}` is `{kind}`; numbers, texts, true, false and `None` can be told"
            raise TypeError(f"{what}, and arrays are for tables")
        if isinstance(known, float) and not math.isfinite(known):
            raise ArithmeticError(f"`{key}` is {known}; `None` is for what cannot be said")
        plain[key] = known
    return plain


def _lines(metrics: Mapping[str, Any], brief: Collection[str], *, is_topic: bool) -> Iterator[str]:
    """What the measures found, for the terminal: a line for each, and one for each reason.

    Args:
        metrics: of the run.
        brief: measures that nobody has named; of these the first few numbers that there are.
        is_topic: whether the run is about what they ask; if not, no reasons are told.
    """
    silent = []
    for label, found in metrics.get("measures", {}).items():
        said = _numbers(found) if label in brief else found
        told = [f"{key} {_spell(value)}" for key, value in said.items()]
        if label in brief and len(told) > _BRIEF:
            told = [*told[:_BRIEF], "..."]
        if told:
            yield f"{label}: {', '.join(told)}"
        else:
            silent.append(label)
    if silent:
        yield f"nothing to measure: {', '.join(silent)}"
    left_out: Mapping[str, str] = metrics.get(LEFT_OUT, {})
    if left_out and not is_topic:
        yield f"left out: {', '.join(left_out)} (`{METRICS}` says which signals they need)"
        return
    reasons: dict[str, list[str]] = {}
    for label, reason in left_out.items():
        reasons.setdefault(reason, []).append(label)
    for reason, labels in reasons.items():
        yield f"left out: {', '.join(labels)} ({reason})"


def _numbers(found: Mapping[str, Any]) -> dict[str, Any]:
    """What is known, apart from how it was measured."""
    return {
        key: value
        for key, value in found.items()
        if value is not None and not isinstance(value, bool)
    }


def _spell(value: object) -> str:
    return f"{value:.6g}" if isinstance(value, float) else "-" if value is None else str(value)
