"""Estimates of means and of paired differences."""

from collections.abc import Mapping, Sequence

from orchestrator.intervals import Estimate, mean, share

Sample = Mapping[int, float]
"""A metric by seed, of the runs that did not fail and had something to measure."""


def differences(a: Sample, b: Sample) -> list[float]:
    """`a` minus `b` for every seed that both have, by seed (common random numbers)."""
    return [a[seed] - b[seed] for seed in sorted(a.keys() & b.keys())]


def mean_of(values: Sequence[float]) -> Estimate | None:
    """The mean with the interval of 95 % of Student's t; `None` without values."""
    return mean(values) if values else None


def share_of(values: Sequence[bool]) -> Estimate | None:
    """The share of `True` with the interval of 95 % of Wilson; `None` without values."""
    return share(values) if values else None


def percent(found: Estimate | None) -> Estimate | None:
    """A share, or a difference of shares, in percent or points."""
    if found is None or found.low is None or found.high is None:
        return None if found is None else Estimate(100 * found.value, None, None)
    return Estimate(100 * found.value, 100 * found.low, 100 * found.high)
