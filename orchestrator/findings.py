"""The files that a report leaves in a run directory."""

import json
import math
from collections.abc import Collection, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

import numpy as np

from orchestrator.errors import CosimError, PluginError, defects, in_words
from orchestrator.measure import Answer, Measure, Panel
from orchestrator.questions import Questions
from orchestrator.raised_at import raised_at
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


class NotAnsweredError(PluginError):
    """A report or measures failed; what the others found is written.

    Attributes:
        says_why: whether all of them say what is wrong, rather than fail by a mistake in them.
    """

    def __init__(self, failures: Mapping[str, BaseException]) -> None:
        text = "; ".join(f"{what} failed: {in_words(error)}" for what, error in failures.items())
        first = next(iter(failures.values()))
        super().__init__(text, raised_at(first))
        self.says_why = all(isinstance(error, _SAYING) for error in failures.values())


_SAYING: Final = (CosimError, ValueError, OSError)


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
        NotAnsweredError: some of them failed, though the recording is not damaged.
    """
    formats = chosen(asked.tables)
    recording, report = Recording(directory), asked.report
    asking = _Asking(damaged)
    found: dict[str, Any] = {}
    if report is not None:
        with asking.about("report", f"report `{asked.report_name}`"):
            # through JSON and back, so that everybody sees what a reader of the file will see
            found = _read_back(dict(report.metrics(recording)))
    answers = {}
    for label, each in asked.measures.items():
        with asking.about(label):
            answers[label] = _asked(each, recording)
    answers |= _optional(asked.optional, recording, asking)
    files: list[Path] = []
    for label, answer in answers.items():
        tables: dict[str, Table | Blocks] = {}
        tables |= {f"{label}-{name}": table for name, table in answer.tables.items()}
        tables |= {f"{label}-{name}": table for name, table in answer.long_tables.items()}
        with asking.about(label):
            files += write_tables(tables, directory / TABLES, formats)
    if answers:
        found["measures"] = {label: answer.numbers for label, answer in answers.items()}
    if asking.left_out:
        found[LEFT_OUT] = asking.left_out
    metrics = _read_back(found)
    write_json(directory / METRICS, metrics)
    files.insert(0, directory / METRICS)
    panels = dict(_panels(answers))
    if "report" in asking.left_out:
        report = None
    if figure and report is not None:
        with asking.about("figure", f"the figure of report `{asked.report_name}`"):
            report.figure(recording, metrics, directory / FIGURE)
            files.append(directory / FIGURE)
    if figure and panels:
        from orchestrator.drawing import draw_panels  # noqa: PLC0415 - matplotlib is slow to load

        files.append(draw_panels(panels, directory / PANELS))
    summary = ""
    if report is not None:
        with asking.about("summary", f"the summary of report `{asked.report_name}`"):
            summary = report.summary(metrics, recording.manifest)
    asking.check()
    is_topic = any(asked.optional[label].signals() for label in answers if label in asked.optional)
    brief = asked.optional.keys() & answers.keys()
    lines = "\n".join(filter(None, [summary, *_lines(metrics, brief, is_topic=is_topic)]))
    return Findings(metrics, lines, tuple(files))


def _read_back(found: dict[str, Any]) -> dict[str, Any]:
    plain: dict[str, Any] = json.loads(json.dumps(found, allow_nan=False, default=_plain))
    return plain


def _panels(answers: Mapping[str, Answer]) -> Iterator[tuple[str, Panel]]:
    for label, answer in answers.items():
        if answer.panel is not None:
            yield label, answer.panel
        for name, panel in answer.panels.items():
            yield f"{label}: {name}", panel


class _Asking:
    """What comes of asking one after the other; who fails does not take the others along.

    Args:
        damaged: whether the recording is.
    """

    def __init__(self, damaged: bool) -> None:  # noqa: FBT001 - of one caller
        self.left_out: dict[str, str] = {}
        self._damaged = damaged
        self._failures: dict[str, BaseException] = {}

    @contextmanager
    def about(self, label: str, what: str = "") -> Iterator[None]:
        """Note why there is no `label`, which is a measure unless `what` says something else."""
        try:
            yield
        except defects() as error:  # whoever reads half a recording may stumble over anything
            if self._damaged:
                lost = isinstance(error, RecordingError)
                self.left_out[label] = str(error) if lost else "not to be made of what is left"
                return
            self.left_out[label] = f"failed: {in_words(error)}"
            self._failures[what or f"measure `{label}`"] = error

    def check(self) -> None:
        """Raise what failed, now that all were asked."""
        if self._failures:
            first = next(iter(self._failures.values()))
            raise NotAnsweredError(self._failures) from first


def _optional(
    measures: Mapping[str, Measure], recording: Recording, asking: _Asking
) -> dict[str, Answer]:
    """The answers that there are; why there are no others is noted."""
    answers: dict[str, Answer] = {}
    for label, measure in measures.items():
        with asking.about(label):
            missing = [f"`{name}`" for name in measure.signals() if name not in recording]
            if missing:
                asking.left_out[label] = f"not recorded: {', '.join(missing)}"
                continue
            try:
                answers[label] = _asked(measure, recording)
            except (RecordingError, ValueError) as error:
                asking.left_out[label] = str(error)
    return answers


def _asked(measure: Measure, recording: Recording) -> Answer:
    found = measure.compute(recording)
    answer = found if isinstance(found, Answer) else Answer(numbers=found)
    return replace(answer, numbers=_finite(answer.numbers))


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
