"""`index.html` of an experiment: its runs in one file that needs neither a server nor a network."""

import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from orchestrator.experiment import tables
from orchestrator.experiment.page import asked, columns, contrasts
from orchestrator.experiment.page.kept import folders
from orchestrator.experiment.page.parts import Part, joined, read_parts
from orchestrator.experiment.report import Results, Row
from orchestrator.page.arrays import Arrays
from orchestrator.page.document import PAGE, WEB, Document

_WEB: Final = Path(__file__).parent / "web"
SCRIPTS: Final = (
    *(WEB / f"{name}.js" for name in ("inflate", "decode", "dom", "about", "keys")),
    *(
        _WEB / f"{name}.js"
        for name in (
            "filter", "results", "figures", "marks", "axes", "figure", "means", "spread",
            "pairs", "controls", "card", "runs", "asked", "start",
        )
    ),
)  # fmt: skip
"""The scripts of the page, in the order in which they are run."""

_WALL: Final = "wall_s"
_FILES: Final = ("summary.csv", "runs.parquet", "runs.jsonl", "experiment.json")


def make_page(directory: Path) -> Path:
    """Write the page of an experiment into its directory; equal results make equal bytes.

    Args:
        directory: of an experiment, finished or not.

    Returns:
        The file.

    Raises:
        StoredError: there is no experiment in `directory`.
        RecordingError: the file that says what it is is damaged.
    """
    parts = read_parts([directory])
    path = directory / PAGE
    _write(path, parts[0].title, parts)
    return path


def make_joint_page(directories: Sequence[Path], path: Path) -> None:
    """Write one page of several experiments; from which one a run is, is a factor.

    Args:
        directories: of the experiments.
        path: of the page; links on it are relative to its folder.

    Raises:
        CosimError: what is a factor of one is a metric of another.
        OSError: the page cannot be written.
        StoredError: there is no experiment in one of the directories.
        RecordingError: the file that says what one is is damaged.
    """
    _write(path, path.stem, read_parts(directories))


def _write(path: Path, title: str, parts: Sequence[Part]) -> None:
    arrays = Arrays()
    Document(
        title=title,
        data=content(title, parts, path.parent, arrays),
        arrays=arrays,
        styles=[WEB / "page.css", _WEB / "experiment.css"],
        scripts=SCRIPTS,
    ).write(path)


@dataclass(frozen=True, slots=True)
class _Metric:
    """A column of numbers, or of text."""

    name: str
    path: str
    unit: str
    kind: str


def content(title: str, parts: Sequence[Part], folder: Path, arrays: Arrays) -> Mapping[str, Any]:
    """All that the scripts of the page know, but for the arrays.

    Args:
        title: of the page.
        parts: the experiments that it shows.
        folder: of the page.
        arrays: where arrays are put.
    """
    results = joined(parts)
    experiment, rows = results.experiment, results.rows
    of_row = columns.combination_of(experiment, rows)
    every = list(_metrics(results))
    kept = experiment.combinations[: max(1, columns.MOST_ESTIMATES // max(1, len(every)))]
    summary = tables.summary(experiment, rows, [each.name for each in every])[: len(kept)]
    here = columns.chosen(rows, of_row, len(kept), len(every))
    shown: list[Row] = [rows[index] for index in here]
    places = [of_row[index] for index in here]
    drawn = [each.name for each in every if each.kind != columns.TEXT]
    samples = columns.samples(experiment, rows, of_row, drawn)
    counted = {each.name: each.kind == columns.SHARE for each in every}
    return {
        "about": asked.about(title, results, parts),
        "factors": asked.factors(experiment),
        "levels": [[each.levels[name] for name in experiment.factors] for each in kept],
        "counts": [row["n"] for row in summary],
        "commands": asked.commands(parts, kept),
        "runs": columns.runs(shown, places, arrays),
        "runs_left_out": len(rows) - len(shown),
        "combinations_left_out": len(experiment.combinations) - len(kept),
        "folders": folders(parts, folder, shown, places),
        "metrics": [
            {
                "name": each.name,
                "path": each.path,
                "unit": each.unit,
                "kind": each.kind,
                **columns.metric(each.name, each.kind, shown, summary, arrays),
            }
            for each in every
        ],
        "pairs": contrasts.packed(contrasts.contrasts(experiment, kept), samples, counted, arrays),
        "files": [name for part in parts for name in _files(part.directory, folder)],
    }


def _metrics(results: Results) -> Iterator[_Metric]:
    """Those of the experiment file, and how long the runs took."""
    units = tables.units(results.experiment, results.metrics)
    for name, path in results.experiment.metrics.items():
        values = [row[name] for row in results.rows if row[name] is not None]
        yield _Metric(name, path, units.get(name, ""), columns.kind(values))
    yield _Metric(_WALL, "the wall time of the run", "s", columns.NUMBER)


def _files(directory: Path, folder: Path) -> list[str]:
    """What else there is to open of an experiment, relative to the page."""
    report = directory / "report"
    written = sorted(report.iterdir()) if report.is_dir() else []
    every = [*(directory / name for name in _FILES), *written]
    return [Path(os.path.relpath(path, folder)).as_posix() for path in every if path.is_file()]
