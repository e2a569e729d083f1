"""Distances in bins, and what measures say about many values."""

import itertools
from collections.abc import Iterator, Sequence
from typing import Any, Final, Literal

import numpy as np

from orchestrator.errors import ParameterProblem
from orchestrator.intervals import wilson
from orchestrator.parameters import parameter
from orchestrator.signal import Array

EDGES: Final[Any] = tuple(20.0 * k for k in range(26))
"""20 m wide up to 500 m, as in 3GPP TR 36.885, annex A."""


def edges_parameter(default: tuple[float, ...] = EDGES) -> Any:
    """The parameter of measures over distance; `default` [m]."""
    return parameter(default, unit="m", minimum=0.0, doc="of the bins of distance, ascending")


def edges_problems(edges: Sequence[float]) -> Iterator[ParameterProblem]:
    """What is wrong with edges of bins."""
    if len(edges) < 2:
        yield ParameterProblem(("edges",), "a bin needs two edges: write at least two distances")
    elif any(b <= a for a, b in itertools.pairwise(edges)):
        yield ParameterProblem(("edges",), "edges of bins have to ascend, each beyond the last")


def bin_of(distance: Array, edges: Sequence[float]) -> Array:
    """The bin `[edges[k], edges[k + 1])` of every distance; -1 outside of all, shape (n,)."""
    found = np.searchsorted(np.asarray(edges), distance, side="right") - 1
    return np.asarray(np.where(found < len(edges) - 1, found, -1))


def spread(values: Array, name: str, unit: Literal["s", "ms", "m", ""]) -> dict[str, float | None]:
    """Mean, median, 95th and 99th percentile of `values`, shape (n,), by name; `None` of none."""
    return spread_of(np.sort(values), name, unit)


def spread_of(
    ordered: Array, name: str, unit: Literal["s", "ms", "m", ""]
) -> dict[str, float | None]:
    """`spread` of values that ascend, shape (n,), without another copy of them."""
    ending = f"_{unit}" if unit else ""
    labels = ("mean", "median", "p95", "p99")
    if len(ordered) == 0:
        return {f"{name}_{label}{ending}": None for label in labels}
    found = _spread(ordered)
    return {
        f"{name}_{label}{ending}": float(each) for label, each in zip(labels, found, strict=True)
    }


def _spread(ordered: Array) -> tuple[float, ...]:
    """Mean, median, 95th and 99th percentile of values that ascend.

    The mean is that of ordered values, so that it does not depend on the order in which they were
    found, not even in its last digit. `np.quantile` may reorder what it is given, and finds in
    order what is.
    """
    return ordered.mean(), *np.quantile(ordered, (0.5, 0.95, 0.99), overwrite_input=True)


def spread_by_bin(bins: Array, values: Array, edges: Sequence[float]) -> dict[str, Array]:
    """Count, mean, median, 95th and 99th percentile of times in every bin [s].

    Args:
        bins: as `bin_of` returns them, shape (n,).
        values: times [s], shape (n,).
        edges: of the bins.

    Returns:
        Columns, shape (bin,); NaN where a bin is empty.
    """
    order = np.argsort(bins, kind="stable")
    ends = np.searchsorted(bins[order], np.arange(len(edges)))
    table = np.full((len(edges) - 1, 4), np.nan)
    for k, (start, end) in enumerate(itertools.pairwise(ends)):
        if end > start:
            table[k] = _spread(np.sort(values[order[start:end]]))
    mean, median, p95, p99 = table.T
    quantiles = {"mean_s": mean, "median_s": median, "p95_s": p95, "p99_s": p99}
    return {**bin_columns(edges), "count": np.diff(ends), **quantiles}


def shares(part: Array, whole: Array) -> tuple[Array, Array, Array]:
    """Shares, and the bounds of their intervals of 95 %, of counts; NaN of none, shape (n,) each.

    Args:
        part: how many of `whole`, shape (n,).
        whole: how many there are, shape (n,).
    """
    found, low, high = np.full((3, len(whole)), np.nan)
    known = whole > 0
    found[known] = part[known] / whole[known]
    low[known], high[known] = wilson(part[known], whole[known])
    return found, low, high


def share(part: int, whole: int, name: str) -> dict[str, float | None]:
    """The share `part` of `whole` by `name`, and its bounds; `None` of none."""
    names = (name, f"{name}_low", f"{name}_high")
    found = [float(each[0]) for each in shares(np.array([part]), np.array([whole]))]
    return dict(zip(names, found if whole else (None, None, None), strict=True))


def bin_columns(edges: Sequence[float]) -> dict[str, Array]:
    """The columns that say which distances a row is about [m], shape (bin,) each."""
    return {"from_m": np.array(edges[:-1]), "to_m": np.array(edges[1:])}
