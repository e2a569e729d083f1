"""The advantage of one relay method over another, in points of PRR, over two factors."""

from collections.abc import Sequence
from dataclasses import dataclass

from orchestrator.experiment.report import Results
from orchestrator.intervals import Estimate
from studies.method.estimates import differences, mean_of, percent
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
    """One condition; rates are means over runs, 0 to 1.

    Attributes:
        column, row: its levels.
        n: the number of seeds that both methods have.
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
        found = self.difference
        if found is None or found.low is None or found.high is None:
            return False
        return found.low > 0.0 or found.high < 0.0


def cells(asked: Map, results: Results) -> list[Cell]:
    """The cells of a map, row by row, of the runs that did not fail."""
    levels = results.experiment.levels
    return [
        _cell(asked, results, column, row)
        for row in levels[asked.rows]
        for column in levels[asked.columns]
    ]


def _cell(asked: Map, results: Results, column: str, row: str) -> Cell:
    def sample(method: str) -> dict[int, float]:
        wanted = {METHOD: method, asked.columns: column, asked.rows: row}
        return {
            run["seed"]: float(run["prr"])
            for run in results.rows
            if run["error"] is None
            and run["prr"] is not None
            and all(run[factor] == level for factor, level in wanted.items())
        }

    one, other = sample(asked.better), sample(asked.worse)
    found = differences(one, other)
    return Cell(
        column=column,
        row=row,
        n=len(found),
        difference=percent(mean_of(found)),
        better=mean_of(list(one.values())),
        worse=mean_of(list(other.values())),
    )


def by_row(found: Sequence[Cell]) -> dict[str, list[Cell]]:
    """The cells of each row, in the order of the columns."""
    table: dict[str, list[Cell]] = {}
    for cell in found:
        table.setdefault(cell.row, []).append(cell)
    return table
