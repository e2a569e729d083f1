"""Estimates of means and of paired differences."""

from collections.abc import Sequence

from orchestrator.intervals import Estimate, Sample, differences, mean, share

__all__ = ["Sample", "differences", "mean_of", "percent", "share_of"]


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
