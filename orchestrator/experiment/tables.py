"""The results of an experiment: one row per run, one row per combination of levels.

runs.parquet   factors, seed, metrics, fingerprint, times and error of every finished run
summary.csv    for every combination and metric: mean or share, interval of 95 %, number of values
"""

import csv
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from orchestrator.campaign.work import Result, RunKey
from orchestrator.campaign.workers import require
from orchestrator.errors import Problem, ScenarioError
from orchestrator.experiment.plan import Experiment
from orchestrator.intervals import Estimate, mean, share
from orchestrator.scenario.diagnosis import show
from orchestrator.suggestion import suggestion

RUNS: Final = "runs.parquet"
SUMMARY: Final = "summary.csv"
TIMES: Final = ("wall_s", "cpu_s")
"""The columns that are not the same if the runs are made again."""

Row = dict[str, Any]

_UNIT: Final = "unit"
"""The key of the unit of the numbers that stand beside it."""


def selected(experiment: Experiment, metrics: Mapping[str, Any]) -> Row:
    """The columns of the metrics of one run.

    Raises:
        ScenarioError: the experiment file names metrics that are none.
    """
    problems, row = [], {}
    for name, path in experiment.metrics.items():
        value, what = _value(metrics, path)
        if what is not None:
            where = experiment.document.value(("metrics", name))
            problems.append(Problem(where, f"metrics.{name}: {what}"))
        row[name] = value
    if problems:
        raise ScenarioError(problems)
    return row


def units(experiment: Experiment, metrics: Iterable[Mapping[str, Any]]) -> dict[str, str]:
    """The units of metrics beside which a run says one, under `unit`; pure numbers have none.

    Args:
        experiment: whose metrics they are.
        metrics: of each run all that were found.
    """
    found: dict[str, set[str]] = {}
    for each in metrics:
        for name, path in experiment.metrics.items():
            unit, what = _value(each, ".".join((*path.split(".")[:-1], _UNIT)))
            if what is None and isinstance(unit, str) and unit != "1":
                found.setdefault(name, set()).add(unit)
    return {name: said.pop() for name, said in found.items() if len(said) == 1}


def _value(metrics: Mapping[str, Any], path: str) -> tuple[Any, str | None]:
    """The metric at `path`, or what is wrong with it."""
    at: Any = metrics
    for key in path.split("."):
        if at is None:
            return None, None  # there was nothing to measure in this run
        if not isinstance(at, dict) or key not in at:
            offers = _paths(metrics)
            return None, f"the runs have no metric `{path}`; {suggestion(path, offers)}"
        at = at[key]
    if isinstance(at, dict | list):
        offers = [each for each in _paths(metrics) if each.startswith(f"{path}.")]
        return None, f"`{path}` is {show(at)}, not one value; {suggestion(path, offers)}"
    return at, None


def _paths(metrics: Mapping[str, Any], prefix: str = "") -> list[str]:
    """The paths of all single values."""
    found = []
    for key, value in metrics.items():
        if isinstance(value, dict):
            found += _paths(value, f"{prefix}{key}.")
        elif not isinstance(value, list):
            found.append(prefix + key)
    return found


def rows(experiment: Experiment, results: Mapping[RunKey, Result]) -> list[Row]:
    """One row per finished run, by combination and seed."""
    found = []
    for key in sorted(results, key=lambda key: (key.combination, key.seed)):
        result = results[key]
        empty = dict.fromkeys(experiment.metrics)
        found.append(
            {
                **experiment.combinations[key.combination].levels,
                "seed": key.seed,
                **(selected(experiment, result.metrics) if result.error is None else empty),
                "fingerprint": result.fingerprint,
                "wall_s": result.wall,
                "cpu_s": result.cpu,
                "error": result.error,
            }
        )
    return found


def write_runs(
    directory: Path,
    experiment: Experiment,
    found: Sequence[Mapping[str, Any]],
    units_of: Mapping[str, str],
) -> None:
    """Write `runs.parquet` in one piece; columns with a unit have it in their metadata.

    Args:
        directory: of the experiment.
        experiment: that was conducted.
        found: a row per finished run.
        units_of: metrics, as far as they have one.

    Raises:
        MissingExtraError: pyarrow is not installed.
    """
    arrow, parquet = require("pyarrow"), require("pyarrow.parquet")
    texts = (*experiment.factors, "fingerprint", "error")
    types = dict.fromkeys(texts, arrow.string()) | {"seed": arrow.int64()}
    types |= dict.fromkeys(TIMES, arrow.float64())
    for name in experiment.metrics:
        types[name] = _type(arrow, [row[name] for row in found])
    names = [*experiment.factors, "seed", *experiment.metrics, "fingerprint", *TIMES, "error"]
    columns = {
        name: arrow.array([_cast(arrow, types[name], row[name]) for row in found], types[name])
        for name in names
    }
    draft = directory / f"{RUNS}.draft"
    fields = [
        arrow.field(
            name, types[name], metadata={"unit": units_of[name]} if name in units_of else {}
        )
        for name in names
    ]
    parquet.write_table(arrow.table(columns, schema=arrow.schema(fields)), draft)
    draft.replace(directory / RUNS)


def _type(arrow: Any, values: Sequence[Any]) -> Any:
    """The narrowest type that holds all values; text where kinds are mixed."""
    kinds = {type(value) for value in values} - {type(None)}
    if kinds == {bool}:
        return arrow.bool_()
    if kinds == {int}:
        return arrow.int64()
    return arrow.float64() if kinds <= {int, float} else arrow.string()


def _cast(arrow: Any, kind: Any, value: Any) -> Any:
    return str(value) if kind == arrow.string() and value is not None else value


def summary(
    experiment: Experiment,
    found: Sequence[Mapping[str, Any]],
    metrics: Sequence[str] | None = None,
) -> list[Row]:
    """One row per combination: levels, number of runs, and an estimate of every metric.

    Booleans are counted (share, interval of Wilson), numbers averaged (interval of Student's t);
    other metrics and runs in which there was nothing to measure are left out.

    Args:
        experiment: that was conducted.
        found: a row per finished run.
        metrics: columns to estimate; `None`: those that the experiment file names.
    """
    table = []
    done_of: dict[tuple[str, ...], list[Mapping[str, Any]]] = {}
    for row in found:
        if row["error"] is None:
            levels_of_row = tuple(row[factor] for factor in experiment.factors)
            done_of.setdefault(levels_of_row, []).append(row)
    for combination in experiment.combinations:
        levels = combination.levels
        done = done_of.get(tuple(levels[factor] for factor in experiment.factors), [])
        line: Row = {**levels, "n": len(done)}
        for name in experiment.metrics if metrics is None else metrics:
            values = [row[name] for row in done if row[name] is not None]
            estimate = _estimate(values)
            line[name] = None if estimate is None else estimate.value
            line[f"{name}_low"] = None if estimate is None else estimate.low
            line[f"{name}_high"] = None if estimate is None else estimate.high
            line[f"{name}_n"] = len(values)
        table.append(line)
    return table


def _estimate(values: Sequence[Any]) -> Estimate | None:
    if not values:
        return None
    if all(isinstance(value, bool) for value in values):
        return share(values)
    is_numeric = all(isinstance(v, int | float) and not isinstance(v, bool) for v in values)
    return mean([float(v) for v in values]) if is_numeric else None


def write_summary(directory: Path, table: Sequence[Row], units_of: Mapping[str, str]) -> None:
    """Write `summary.csv` in one piece; an empty cell is a value that there is not.

    Args:
        directory: of the experiment.
        table: a row per combination.
        units_of: metrics, as far as they have one; headings are `m [s]`, `m_low [s]`.
    """
    headings = {name: name for name in table[0]}
    for metric, unit in units_of.items():
        for name in (metric, f"{metric}_low", f"{metric}_high"):
            headings[name] = f"{name} [{unit}]"
    draft = directory / f"{SUMMARY}.draft"
    with draft.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(headings.values())
        writer.writerows([row[name] for name in headings] for row in table)
    draft.replace(directory / SUMMARY)
