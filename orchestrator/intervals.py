"""How sure a share that was counted, a mean, or their difference by seed is: intervals of 95 %."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Final

import numpy as np

from orchestrator.signal import Array

Sample = Mapping[int, float]
"""A number by seed, of the runs that did not fail and had something to measure."""

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


def differences(a: Sample, b: Sample) -> list[float]:
    """`a` minus `b` for every seed that both have, by seed (common random numbers)."""
    return [a[seed] - b[seed] for seed in sorted(a.keys() & b.keys())]


def paired_shares(a: Sequence[bool], b: Sequence[bool]) -> Estimate:
    r"""The share of `True` in `a` minus that in `b`, of pairs, at least one.

    Squares of the distances to the bounds of Wilson are added, less what the pairs have in common:

    $$ \hat d - \sqrt{(p_a - l_a)^2 - 2 \phi (p_a - l_a)(u_b - p_b) + (u_b - p_b)^2} $$

    is the lower bound (Newcombe, Statistics in Medicine 17, 1998, 2635, method 10), with the
    correlation $\phi$ of the pairs, corrected for continuity. Pairs that never differ say that
    they rarely do, not that they never would.

    Args:
        a: of the first of each pair, shape (pairs,).
        b: of the second of each pair, shape (pairs,).
    """
    first, second = share(a), share(b)
    count = len(a)
    both = sum(x and y for x, y in zip(a, b, strict=True))
    ones = [sum(a), sum(b)]
    scale = math.sqrt(math.prod(ones) * math.prod(count - each for each in ones))
    cross = both * (count - sum(ones) + both) - (ones[0] - both) * (ones[1] - both)
    corrected = max(cross - count / 2, 0.0) if cross > 0 else float(cross)
    phi = corrected / scale if scale else 0.0
    difference = first.value - second.value
    below = _combined(_distances(first)[0], _distances(second)[1], phi)
    above = _combined(_distances(first)[1], _distances(second)[0], phi)
    return Estimate(difference, difference - below, difference + above)


def _distances(found: Estimate) -> tuple[float, float]:
    """From an estimate down and up to its bounds."""
    low = found.value if found.low is None else found.low
    high = found.value if found.high is None else found.high
    return found.value - low, high - found.value


def _combined(one: float, other: float, phi: float) -> float:
    return math.sqrt(max(0.0, one**2 - 2 * phi * one * other + other**2))


@lru_cache
def student_t(freedom: int, level: float = _LEVEL) -> float:
    """The quantile of Student's t that bounds `level` on two sides.

    Args:
        freedom: degrees of freedom, at least 1.
        level: the probability between the bounds, above 0 and below 1.
    """
    low, high = 0.0, math.pi / 2  # of theta = atan(t / sqrt(freedom))
    for _ in range(60):
        middle = (low + high) / 2
        if _probability_within(middle, freedom) < level:
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
