"""The advantage of one relay method over another, in points of PRR, over two factors."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from orchestrator.experiment.report import Results
from orchestrator.intervals import Estimate, student_t
from studies.method.estimates import Sample, differences, mean_of, percent
from studies.relay.conditions import METHOD


@dataclass(frozen=True, slots=True, kw_only=True)
class Map:
    """What is compared, and over what.

    Attributes:
        columns: the factor whose levels are side by side.
        rows: the factor whose levels are one below the other.
        better: the level of `method` that is hoped to deliver more.
        worse: the one that it is compared with.
    """

    columns: str
    rows: str
    better: str
    worse: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Cell:
    """One condition; rates are means over the seeds that both methods have, 0 to 1.

    Attributes:
        column, row: its levels.
        n: the number of these seeds.
        difference: PRR of the one minus that of the other, by the same seeds [points].
        better: PRR of the one.
        worse: PRR of the other.
    """

    column: str
    row: str
    n: int
    difference: Estimate | None
    better: Estimate | None
    worse: Estimate | None

    @property
    def is_decided(self) -> bool:
        """Whether the interval of the difference leaves out 0."""
        return self.is_decided_among(1)

    def is_decided_among(self, comparisons: int) -> bool:
        """Whether it still does if all of `comparisons` intervals are to hold at once.

        By Bonferroni: each of them of a level of 1 - 0.05 / `comparisons`.
        """
        found = self.difference
        if found is None or found.low is None or found.high is None:
            return False
        freedom = self.n - 1
        wider = student_t(freedom, 1 - 0.05 / comparisons) / student_t(freedom)
        return abs(found.value) > wider * (found.high - found.low) / 2


@dataclass(frozen=True, slots=True, kw_only=True)
class Margin:
    """The advantage at one level of one factor: the mean over all levels of the other.

    Attributes:
        factor: the factor.
        level: its level.
        n: the number of seeds that both methods have in all these cells.
        difference: the mean of the cells' differences, by seed [points].
        change: that minus the same at the first level of the factor, by seed [points]; `None` at
            the first.
    """

    factor: str
    level: str
    n: int
    difference: Estimate | None
    change: Estimate | None


Gains = Mapping[tuple[str, str], Sample]
"""PRR of the one method minus that of the other by seed, by row and column, 0 to 1."""


def cells(asked: Map, results: Results) -> list[Cell]:
    """The cells of a map, row by row, of the runs that did not fail."""
    return [_cell(asked, results, row, column) for row, column in _places(asked, results)]


def margins(asked: Map, results: Results) -> list[Margin]:
    """What each factor of a map does by itself, its rows first."""
    gains = {
        (row, column): _gain(*_samples(asked, results, row, column))
        for row, column in _places(asked, results)
    }
    levels = results.experiment.levels
    rows = {row: [(row, column) for column in levels[asked.columns]] for row in levels[asked.rows]}
    columns = {
        column: [(row, column) for row in levels[asked.rows]] for column in levels[asked.columns]
    }
    return [*_margins(asked.rows, rows, gains), *_margins(asked.columns, columns, gains)]


def _margins(
    factor: str, places: Mapping[str, Sequence[tuple[str, str]]], gains: Gains
) -> Iterator[Margin]:
    means = {level: _mean_gain([gains[place] for place in own]) for level, own in places.items()}
    first = next(iter(means.values()))
    for number, (level, own) in enumerate(means.items()):
        change = differences(own, first) if number else []
        yield Margin(
            factor=factor,
            level=level,
            n=len(own),
            difference=percent(mean_of(list(own.values()))),
            change=percent(mean_of(change)),
        )


def _mean_gain(gains: Sequence[Sample]) -> Sample:
    """The mean of all `gains` for every seed that all of them have."""
    common = sorted(set.intersection(*(set(gain) for gain in gains)))
    return {seed: sum(gain[seed] for gain in gains) / len(gains) for seed in common}


def _gain(one: Sample, other: Sample) -> Sample:
    return {seed: one[seed] - other[seed] for seed in sorted(one.keys() & other.keys())}


def _places(asked: Map, results: Results) -> list[tuple[str, str]]:
    """The levels of rows and columns, cell by cell."""
    levels = results.experiment.levels
    return [(row, column) for row in levels[asked.rows] for column in levels[asked.columns]]


def _samples(asked: Map, results: Results, row: str, column: str) -> tuple[Sample, Sample]:
    """PRR by seed of both methods."""

    def sample(method: str) -> Sample:
        wanted = {METHOD: method, asked.columns: column, asked.rows: row}
        return {
            run["seed"]: float(run["prr"])
            for run in results.rows
            if run["error"] is None
            and run["prr"] is not None
            and all(run[factor] == level for factor, level in wanted.items())
        }

    return sample(asked.better), sample(asked.worse)


def _cell(asked: Map, results: Results, row: str, column: str) -> Cell:
    one, other = _samples(asked, results, row, column)
    gain = _gain(one, other)
    return Cell(
        column=column,
        row=row,
        n=len(gain),
        difference=percent(mean_of(list(gain.values()))),
        better=mean_of([one[seed] for seed in gain]),
        worse=mean_of([other[seed] for seed in gain]),
    )


def by_row(found: Sequence[Cell]) -> dict[str, list[Cell]]:
    """The cells of each row, in the order of the columns."""
    table: dict[str, list[Cell]] = {}
    for cell in found:
        table.setdefault(cell.row, []).append(cell)
    return table
