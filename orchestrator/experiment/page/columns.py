"""The runs of an experiment as columns of its page, and what each combination says of a metric."""

from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np

from orchestrator.experiment.page.contrasts import Samples, estimate_columns
from orchestrator.experiment.plan import Experiment
from orchestrator.experiment.report import Row
from orchestrator.intervals import Estimate
from orchestrator.page.arrays import Arrays

MOST_VALUES: Final = 40_000
"""Metrics of single runs on a page; beyond that it has the runs of the first seeds only."""

MOST_ESTIMATES: Final = 8_000
"""Metrics of combinations on a page; beyond that it has the first combinations only."""

_PRINT: Final = 12
"""Letters of a fingerprint that are shown."""

NUMBER: Final = "number"
SHARE: Final = "share"
TEXT: Final = "text"
"""What a metric is: averaged, counted, or neither."""


def kind(values: Sequence[Any]) -> str:
    """What a metric is, from its values without `None`, as the tables of Python see it."""
    if all(isinstance(value, bool) for value in values):
        return SHARE if values else NUMBER
    numeric = all(isinstance(v, int | float) and not isinstance(v, bool) for v in values)
    return NUMBER if numeric else TEXT


def combination_of(experiment: Experiment, rows: Sequence[Row]) -> list[int]:
    """The index of the combination of every row."""
    factors = experiment.factors
    at = {tuple(c.levels[f] for f in factors): i for i, c in enumerate(experiment.combinations)}
    return [at[tuple(row[factor] for factor in factors)] for row in rows]


def chosen(rows: Sequence[Row], combinations: Sequence[int], kept: int, metrics: int) -> list[int]:
    """The indices of the rows that have a place on the page.

    Args:
        rows: of all runs.
        combinations: of each row.
        kept: how many combinations are on the page, the first ones.
        metrics: how many there are.
    """
    here = [index for index, each in enumerate(combinations) if each < kept]
    most = max(1, MOST_VALUES // max(1, metrics))
    if len(here) <= most:
        return here
    seeds = sorted({rows[index]["seed"] for index in here})
    few = set(seeds[: max(1, most // max(1, kept))])
    return [index for index in here if rows[index]["seed"] in few]


def samples(
    experiment: Experiment, rows: Sequence[Row], combinations: Sequence[int], metrics: Sequence[str]
) -> Samples:
    """The values of `metrics` by combination and seed, of runs that did not fail and have one."""
    found: dict[str, list[dict[int, Any]]] = {
        name: [{} for _ in experiment.combinations] for name in metrics
    }
    for row, combination in zip(rows, combinations, strict=True):
        if row["error"] is None:
            for name in metrics:
                if row[name] is not None:
                    found[name][combination][row["seed"]] = row[name]
    return found


def runs(rows: Sequence[Row], combinations: Sequence[int], arrays: Arrays) -> Mapping[str, Any]:
    """What every run on the page has besides its metrics.

    Args:
        rows: of these runs.
        combinations: of these rows.
        arrays: of the page.
    """
    seeds = sorted({row["seed"] for row in rows})
    at = {seed: index for index, seed in enumerate(seeds)}
    places = np.array([at[row["seed"]] for row in rows], np.int64)
    return {
        "seeds": list(map(str, seeds)),
        "seed": arrays.add(places, "i4", deltas=1),
        "combination": arrays.add(np.array(combinations, np.int64), "i4", deltas=1),
        "wall": arrays.add(np.array([row["wall_s"] for row in rows], np.float64), "f4"),
        "fingerprints": [_short(row["fingerprint"]) for row in rows],
        "errors": {str(i): row["error"] for i, row in enumerate(rows) if row["error"] is not None},
    }


def _short(fingerprint: str | None) -> str:
    return "" if fingerprint is None else fingerprint.rpartition(":")[2][:_PRINT]


def metric(
    name: str, of: str, rows: Sequence[Row], summary: Sequence[Row], arrays: Arrays
) -> Mapping[str, Any]:
    """A metric: of every run on the page, and what each combination says of it.

    Args:
        name: of the metric.
        of: what it is, see `kind`.
        rows: of the runs on the page.
        summary: of the combinations on the page, as `summary.csv` has them.
        arrays: of the page.
    """
    values = [row[name] for row in rows]
    if of == TEXT:
        return {"texts": [None if value is None else str(value) for value in values]}
    estimates = [_estimate(name, row) for row in summary]
    return {
        "values": arrays.add(np.array(values, np.float64), "f8"),
        "n": arrays.add(np.array([row[f"{name}_n"] for row in summary], np.int64), "i4"),
        **{f"mean_{key}": each for key, each in estimate_columns(estimates, arrays).items()},
    }


def _estimate(name: str, row: Row) -> Estimate | None:
    if row[name] is None:
        return None
    return Estimate(row[name], row[f"{name}_low"], row[f"{name}_high"])
