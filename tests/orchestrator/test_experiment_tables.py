"""The tables of an experiment: a column has the type of its values, and estimates are of those."""

import csv
import math
from pathlib import Path
from typing import Any

import pytest

from orchestrator.campaign.work import Result, RunKey
from orchestrator.experiment import tables
from tests.orchestrator.page.results import planned

pytest.importorskip("pyarrow.parquet", reason="needs the extra `experiment`")

METRICS = {name: name for name in ("flag", "count", "gap", "mixed", "name", "either", "none")}
RUNS: dict[RunKey, dict[str, Any]] = {
    RunKey(1, 0): {"flag": True, "count": 3, "gap": 1.5, "mixed": 1, "name": "a", "either": True},
    RunKey(2, 0): {"flag": False, "count": 5, "gap": None, "mixed": 2.5, "name": "b", "either": 7},
    RunKey(1, 1): {
        "flag": None,
        "count": None,
        "gap": 4.0,
        "mixed": 3,
        "name": None,
        "either": 0.5,
    },
}


def rows_of(runs: dict[RunKey, dict[str, Any]], failed: RunKey | None = None) -> list[tables.Row]:
    experiment = planned({"speed": ("slow", "fast")}, (1, 2), METRICS)
    results = {
        key: Result(
            wall=2.0, cpu=1.0, fingerprint=f"{key.seed}", metrics=found | {"none": None}, error=None
        )
        for key, found in runs.items()
    }
    if failed is not None:
        results[failed] = Result(wall=2.0, fingerprint=None, metrics={}, error="lost")
    return tables.rows(experiment, results)


def written(folder: Path, rows: list[tables.Row]) -> Any:
    """The table as pyarrow reads it."""
    from pyarrow import parquet  # noqa: PLC0415 - of an extra

    experiment = planned({"speed": ("slow", "fast")}, (1, 2), METRICS)
    tables.write_runs(folder, experiment, rows, {"gap": "m"})
    assert [path.name for path in folder.iterdir()] == ["runs.parquet"]  # no draft is left
    return parquet.read_table(folder / "runs.parquet")


def test_a_column_has_the_narrowest_type_of_its_values(tmp_path: Path) -> None:
    """Booleans are no integers; whole numbers beside others are numbers; text takes everything."""
    found = written(tmp_path, rows_of(RUNS))
    types = {field.name: str(field.type) for field in found.schema}
    assert types == {
        "speed": "string",
        "seed": "int64",
        "flag": "bool",
        "count": "int64",
        "gap": "double",
        "mixed": "double",
        "name": "string",
        "either": "string",
        "none": "double",
        "fingerprint": "string",
        "wall_s": "double",
        "cpu_s": "double",
        "error": "string",
    }
    assert found.schema.field("gap").metadata == {b"unit": b"m"}
    assert not found.schema.field("count").metadata


def test_a_table_has_the_values_of_the_runs_by_combination_and_seed(tmp_path: Path) -> None:
    found = written(tmp_path, rows_of(RUNS, failed=RunKey(2, 1))).to_pydict()
    assert found["speed"] == ["slow", "slow", "fast", "fast"]
    assert found["seed"] == [1, 2, 1, 2]
    assert found["flag"] == [True, False, None, None]
    assert found["count"] == [3, 5, None, None]
    assert found["gap"] == [1.5, None, 4.0, None]
    assert found["mixed"] == [1.0, 2.5, 3.0, None]
    assert found["either"] == ["True", "7", "0.5", None]  # not the text "None"
    assert found["error"] == [None, None, None, "lost"]


def test_estimates_are_of_the_runs_that_had_something_to_measure() -> None:
    """Of 3 and 5 the mean is 4; its interval is t(0.975, 1) = 12.706 times the error, 1."""
    experiment = planned({"speed": ("slow", "fast")}, (1, 2), METRICS)
    slow, fast = tables.summary(experiment, rows_of(RUNS, failed=RunKey(2, 1)))
    assert (slow["speed"], slow["n"], fast["speed"], fast["n"]) == ("slow", 2, "fast", 1)
    assert slow["count"] == 4.0
    assert slow["count_high"] - slow["count"] == pytest.approx(12.7062, abs=1e-4)
    assert slow["count"] - slow["count_low"] == pytest.approx(12.7062, abs=1e-4)
    assert (slow["gap"], slow["gap_low"], slow["gap_n"]) == (1.5, None, 1)
    assert (fast["count"], fast["count_n"]) == (None, 0)
    assert (slow["name"], slow["either"], slow["name_n"]) == (None, None, 2)


def test_a_share_has_the_interval_of_wilson() -> None:
    """One of two: z^2 = 3.8415; 1/2 plus and minus z sqrt(1/8 + z^2/16) / (1 + z^2/2)."""
    experiment = planned({"speed": ("slow", "fast")}, (1, 2), METRICS)
    slow, _ = tables.summary(experiment, rows_of(RUNS))
    z = 1.959964
    half = z * math.sqrt(1 / 8 + z**2 / 16) / (1 + z**2 / 2)
    assert slow["flag"] == 0.5
    assert slow["flag_low"] == pytest.approx(0.5 - half, abs=1e-6)
    assert slow["flag_high"] == pytest.approx(0.5 + half, abs=1e-6)


def test_a_summary_says_units_and_leaves_cells_empty(tmp_path: Path) -> None:
    experiment = planned({"speed": ("slow", "fast")}, (1, 2), METRICS)
    table = tables.summary(experiment, rows_of(RUNS), ("gap", "count"))
    tables.write_summary(tmp_path, table, {"gap": "m"})
    assert [path.name for path in tmp_path.iterdir()] == ["summary.csv"]
    with (tmp_path / "summary.csv").open(newline="") as file:
        heading, slow, fast = csv.reader(file)
    assert heading[:6] == ["speed", "n", "gap [m]", "gap_low [m]", "gap_high [m]", "gap_n"]
    assert (slow[:6], fast[:6]) == (
        ["slow", "2", "1.5", "", "", "1"],
        ["fast", "1", "4.0", "", "", "1"],
    )


@pytest.mark.parametrize(
    ("runs", "unit"),
    [
        ([{"a": {"gap": 1.0, "unit": "m"}}, {"a": {"gap": 2.0, "unit": "m"}}], {"gap": "m"}),
        ([{"a": {"gap": 1.0, "unit": "m"}}, {"a": {"gap": 2.0, "unit": "s"}}], {}),
        ([{"a": {"gap": 1.0, "unit": "1"}}], {}),
        ([{"a": {"gap": 1.0, "unit": 3}}], {}),
        ([{"a": None}, {"a": {"gap": 1.0, "unit": "m"}}], {"gap": "m"}),
        ([{"a": {"gap": 1.0}, "unit": "m"}], {}),
    ],
)
def test_a_unit_is_that_which_all_runs_say_beside_the_metric(
    runs: list[dict[str, Any]], unit: dict[str, str]
) -> None:
    experiment = planned({"speed": ("slow",)}, (1, 2), {"gap": "a.gap"})
    assert tables.units(experiment, runs) == unit
