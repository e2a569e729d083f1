"""Estimates that have an interval."""

from typing import NamedTuple

from orchestrator.intervals import Estimate


class Known(NamedTuple):
    """An estimate with both bounds."""

    value: float
    low: float
    high: float


def known(found: Estimate | None) -> Known:
    """`found`, which is there and has an interval."""
    assert found is not None
    assert found.low is not None
    assert found.high is not None
    return Known(found.value, found.low, found.high)
