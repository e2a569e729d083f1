"""What experiments cost: amounts by hand."""

from dataclasses import dataclass

import pytest

from studies.method.cost import Spent, planned, table
from studies.method.origin import Origin


@dataclass(frozen=True, slots=True)
class Run:
    """A run that did not fail; times in seconds."""

    wall_s: float
    cpu_s: float | None


@pytest.mark.parametrize(
    ("runs", "time", "is_wall"),
    [
        ([Run(7.0, 2.5), Run(9.0, 3.5)], 6.0, False),
        ([Run(7.0, 2.5), Run(9.0, None)], 16.0, True),  # one alone would make the sum too small
        ([], 0.0, False),
    ],
)
def test_time_is_of_processors_where_all_runs_noted_it(
    runs: list[Run], time: float, *, is_wall: bool
) -> None:
    spent = Spent.of("one", runs, 600)
    assert (spent.time, spent.is_wall, spent.planned) == (time, is_wall, 600)
    assert spent.each == (time / len(runs) if runs else 0.0)


def test_runs_are_planned_for_as_many_seeds_as_are_asked() -> None:
    """Six combinations of 4 seeds: with 300 seeds 1,800 runs."""
    origin = Origin(experiment="e", seeds="101..104", planned=24, runs=24, failed=0, sessions=())
    assert planned(origin, 300) == 1800


def test_the_table_has_hours_of_all_planned_runs_on_two_cores() -> None:
    """900 runs of 8 s are 2 h, and planned are twice as many, on two cores; 100 of 18 s 0.5 h."""
    found = [
        Spent(name="first", runs=900, time=7200.0, planned=1800, is_wall=False),
        Spent(name="second", runs=100, time=1800.0, planned=300, is_wall=True),
    ]
    rows = [line.strip("| ").split(" | ") for line in table(found).splitlines()]
    assert [[cell.strip() for cell in row] for row in rows[2:]] == [
        ["first", "900", "2.00", "processor time", "8.00", "1800", "2.00"],
        ["second", "100", "0.50", "wall time", "18.00", "300", "0.75"],
        ["all", "1000", "2.50", "", "", "2100", "2.75"],
    ]
