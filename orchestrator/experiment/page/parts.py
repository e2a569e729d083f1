"""The experiments of a page: one, or several that are joined to one table."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from orchestrator.errors import CosimError
from orchestrator.experiment import stored
from orchestrator.experiment.plan import Combination, Experiment
from orchestrator.experiment.report import Results, Row
from orchestrator.scenario.document import Document

NONE: Final = "-"
"""The level of a factor that an experiment does not have."""

_FACTOR: Final = "experiment"


@dataclass(frozen=True, slots=True, kw_only=True)
class Part:
    """One experiment of a page.

    Attributes:
        title: by which it is told from the others.
        directory: of its results.
        results: of it.
        first: the index of its first combination on the page.
    """

    title: str
    directory: Path
    results: Results
    first: int

    @property
    def experiment(self) -> Experiment:
        """What was planned."""
        return self.results.experiment

    @property
    def planned(self) -> int:
        """How many runs were."""
        return len(self.experiment.combinations) * len(self.experiment.seeds)


def read_parts(directories: Sequence[Path]) -> list[Part]:
    """The experiments in these directories.

    Raises:
        StoredError: there is no experiment in one of them.
        RecordingError: the file that says what one is is damaged.
    """
    parts: list[Part] = []
    first = 0
    for directory in directories:
        results = stored.read(directory)
        stem = results.experiment.path.stem
        again = sum(each.experiment.path.stem == stem for each in parts)
        title = f"{stem} ({again + 1})" if again else stem
        parts.append(Part(title=title, directory=directory, results=results, first=first))
        first += len(results.experiment.combinations)
    return parts


def joined(parts: Sequence[Part]) -> Results:
    """One table of all: of several, a factor says from which experiment a run is.

    A factor that an experiment lacks has the level `-` there; a metric that it lacks, no value.

    Raises:
        CosimError: what is a factor of one is a metric of another.
    """
    if len(parts) == 1:
        return parts[0].results
    factors = list(dict.fromkeys(name for part in parts for name in part.experiment.factors))
    metrics: dict[str, str] = {}
    for part in parts:
        for name, path in part.experiment.metrics.items():
            metrics.setdefault(name, path)
    for name in factors:
        if name in metrics:
            raise CosimError(f"`{name}` is a factor of one experiment and a metric of another")
    factor = _FACTOR
    while factor in factors or factor in metrics:
        factor += "_"
    combinations = [
        Combination(
            {factor: part.title, **{name: each.levels.get(name, NONE) for name in factors}},
            each.overrides,
            each.resolved,
        )
        for part in parts
        for each in part.experiment.combinations
    ]
    empty = {**dict.fromkeys(factors, NONE), **dict.fromkeys(metrics)}
    rows: list[Row] = [
        {factor: part.title, **empty, **row} for part in parts for row in part.results.rows
    ]
    found: list[Mapping[str, Any]] = [each for part in parts for each in part.results.metrics]
    return Results(
        experiment=Experiment(
            path=parts[0].experiment.path,
            scenario=parts[0].experiment.scenario,
            seeds=tuple(sorted({seed for part in parts for seed in part.experiment.seeds})),
            combinations=tuple(combinations),
            metrics=metrics,
            report=None,
            document=Document("", {}, {}),
        ),
        rows=rows,
        metrics=found,
        sessions=[],
        damaged=[f"{part.title}: {said}" for part in parts for said in part.results.damaged],
    )
