"""Estimates of means and of paired differences, as columns of tables."""

from collections.abc import Mapping

from orchestrator.intervals import Estimate, mean

Sample = Mapping[int, float]
"""A metric by seed, of the runs that did not fail and had something to measure."""


def differences(a: Sample, b: Sample) -> list[float]:
    """`a` minus `b` for every seed that both have, by seed (common random numbers)."""
    return [a[seed] - b[seed] for seed in sorted(a.keys() & b.keys())]


def estimate(values: list[float]) -> Estimate | None:
    """The mean with the interval of 95 % of Student's t; `None` without values."""
    return mean(values) if values else None


def columns(name: str, found: Estimate | None, scale: float = 1.0) -> dict[str, float | None]:
    """An estimate as the columns `name`, `name_low` and `name_high`."""
    if found is None:
        return {name: None, f"{name}_low": None, f"{name}_high": None}
    return {
        name: scale * found.value,
        f"{name}_low": None if found.low is None else scale * found.low,
        f"{name}_high": None if found.high is None else scale * found.high,
    }
