"""How sure a share that was counted, or a mean, is: intervals of 95 %."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Final

import numpy as np

from orchestrator.signal import Array

_LEVEL: Final = 0.95
_Z: Final = 1.959963984540054
"""The quantile of the normal distribution for a two-sided interval of 95 %."""


@dataclass(frozen=True, slots=True)
class Estimate:
    """A mean or a share with its interval of 95 %.

    Attributes:
        value: the mean, or the share.
        low, high: bounds; `None` where a single value cannot have any.
    """

    value: float
    low: float | None
    high: float | None


def wilson(successes: Array, trials: Array) -> tuple[Array, Array]:
    """Bounds of the Wilson score interval of 95 % of a proportion, shape (n,) each.

    Wilson, JASA 22(158), 1927; for independent trials.
    """
    share = successes / trials
    scale = 1 + _Z**2 / trials
    middle = (share + _Z**2 / (2 * trials)) / scale
    half = _Z / scale * np.sqrt(share * (1 - share) / trials + _Z**2 / (4 * trials**2))
    low = np.where(successes > 0, middle - half, 0.0)  # exactly, whatever is rounded
    high = np.where(successes < trials, middle + half, 1.0)
    return low, high


def share(values: Sequence[bool]) -> Estimate:
    """The share of `True` among `values`, at least one, with the interval of Wilson."""
    successes, trials = np.array([float(sum(values))]), np.array([float(len(values))])
    low, high = wilson(successes, trials)
    return Estimate(float(successes[0] / trials[0]), float(low[0]), float(high[0]))


def mean(values: Sequence[float]) -> Estimate:
    r"""The mean of independent `values`, at least one, with the interval of Student's t.

    $$ \bar x \pm t_{0.975, n - 1} s / \sqrt n $$
    """
    middle, n = math.fsum(values) / len(values), len(values)
    if n == 1:
        return Estimate(middle, None, None)
    deviation = math.sqrt(math.fsum((value - middle) ** 2 for value in values) / (n - 1))
    half = student_t(n - 1) * deviation / math.sqrt(n)
    return Estimate(middle, middle - half, middle + half)


@lru_cache
def student_t(freedom: int) -> float:
    """The quantile of Student's t that bounds 95 % on two sides.

    Args:
        freedom: degrees of freedom, at least 1.
    """
    low, high = 0.0, math.pi / 2  # of theta = atan(t / sqrt(freedom))
    for _ in range(60):
        middle = (low + high) / 2
        if _probability_within(middle, freedom) < _LEVEL:
            low = middle
        else:
            high = middle
    return math.tan((low + high) / 2) * math.sqrt(freedom)


def _probability_within(theta: float, freedom: int) -> float:
    """P(|T| <= tan(theta) sqrt(freedom)); Abramowitz and Stegun, equations 26.7.3 and 26.7.4."""
    is_odd = freedom % 2 == 1
    cosine, total = math.cos(theta), 0.0
    term = cosine if is_odd else 1.0
    for power in range(1 if is_odd else 0, freedom - 1, 2):
        total += term
        term *= cosine**2 * (power + 1) / (power + 2)
    if is_odd:
        return 2 / math.pi * (theta + math.sin(theta) * total)
    return math.sin(theta) * total
