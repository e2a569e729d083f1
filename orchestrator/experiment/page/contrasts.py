"""Differences of two levels of a factor by the same seeds, under every condition."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any, Final

import numpy as np

from orchestrator.experiment.plan import Combination, Experiment
from orchestrator.intervals import Estimate, Sample, differences, mean, paired_shares
from orchestrator.page.arrays import Arrays

MOST: Final = 5_000
"""Differences on a page, of all metrics together."""

Samples = Mapping[str, Sequence[Mapping[int, Any]]]
"""The values of each metric at each combination by seed, of runs that have one."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Contrast:
    """Two combinations that differ in one factor.

    Attributes:
        factor: its index.
        first, second: indices of the combinations; the level of the first comes first.
        by_reference: whether the first has the first level of the factor.
    """

    factor: int
    first: int
    second: int
    by_reference: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class Difference:
    """The first minus the second, by seed.

    Attributes:
        estimate: the mean, or the difference of shares, with its interval of 95 %.
        n: the number of seeds that both have.
        more, less: the numbers of those in which the first is above, below.
    """

    estimate: Estimate | None
    n: int
    more: int
    less: int


def contrasts(experiment: Experiment, kept: Sequence[Combination]) -> list[Contrast]:
    """All pairs of combinations that differ in one factor, those with its first level first."""
    levels = experiment.levels
    found: list[Contrast] = []
    for number, factor in enumerate(experiment.factors):
        groups: dict[tuple[str, ...], list[int]] = {}
        for index, each in enumerate(kept):
            rest = tuple(level for name, level in each.levels.items() if name != factor)
            groups.setdefault(rest, []).append(index)
        order = {level: place for place, level in enumerate(levels[factor])}
        for group in groups.values():
            ranked = sorted(group, key=lambda index: order[kept[index].levels[factor]])
            for a, b in combinations(ranked, 2):
                is_first = order[kept[a].levels[factor]] == 0
                found.append(Contrast(factor=number, first=a, second=b, by_reference=is_first))
    return sorted(found, key=lambda each: not each.by_reference)


def difference(first: Mapping[int, Any], second: Mapping[int, Any], *, counted: bool) -> Difference:
    """How two samples differ.

    Args:
        first: values by seed, numbers or booleans.
        second: likewise.
        counted: whether they are booleans: then it is the difference of their shares.
    """
    seeds = sorted(first.keys() & second.keys())
    a, b = [first[seed] for seed in seeds], [second[seed] for seed in seeds]
    found: Estimate | None = None
    if seeds:
        found = paired_shares(a, b) if counted else mean(differences(_real(first), _real(second)))
    more = sum(x > y for x, y in zip(a, b, strict=True))
    less = sum(x < y for x, y in zip(a, b, strict=True))
    return Difference(estimate=found, n=len(seeds), more=more, less=less)


def _real(sample: Mapping[int, Any]) -> Sample:
    return {seed: float(value) for seed, value in sample.items()}


def packed(
    found: Sequence[Contrast], samples: Samples, counted: Mapping[str, bool], arrays: Arrays
) -> Mapping[str, Any]:
    """The differences as the JSON of the page says them; those beyond `MOST` are left out.

    Args:
        found: what to compare.
        samples: of the metrics that are numbers or counted.
        counted: which of these are counted.
        arrays: of the page.
    """
    kept = found[: MOST // max(1, len(samples))]
    return {
        "factor": arrays.add(np.array([each.factor for each in kept], np.int64), "i4"),
        "first": arrays.add(np.array([each.first for each in kept], np.int64), "i4", deltas=1),
        "second": arrays.add(np.array([each.second for each in kept], np.int64), "i4", deltas=1),
        "left_out": len(found) - len(kept),
        "metrics": {
            name: _columns(list(_every(kept, of, counted=counted[name])), arrays)
            for name, of in samples.items()
        },
    }


def _every(
    kept: Sequence[Contrast], of: Sequence[Mapping[int, Any]], *, counted: bool
) -> Iterator[Difference]:
    for each in kept:
        yield difference(of[each.first], of[each.second], counted=counted)


def _columns(found: Sequence[Difference], arrays: Arrays) -> Mapping[str, Any]:
    estimates = [each.estimate for each in found]
    return {
        **estimate_columns(estimates, arrays),
        "n": arrays.add(np.array([each.n for each in found], np.int64), "i4", deltas=1),
        "more": arrays.add(np.array([each.more for each in found], np.int64), "i4", deltas=1),
        "less": arrays.add(np.array([each.less for each in found], np.int64), "i4", deltas=1),
    }


def estimate_columns(found: Sequence[Estimate | None], arrays: Arrays) -> Mapping[str, Any]:
    """Values and bounds as arrays of the page; NaN where there is none."""
    rows = [(None, None, None) if e is None else (e.value, e.low, e.high) for e in found]
    whole = np.array(rows, np.float64).reshape(-1, 3)
    names = ("value", "low", "high")
    return {name: arrays.add(whole[:, k], "f8") for k, name in enumerate(names)}
