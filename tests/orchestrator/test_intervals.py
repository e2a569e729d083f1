"""Intervals of 95 %: tabulated quantiles, and what shifting and stretching the data does."""

import numpy as np
import pytest
from hypothesis import given, strategies as st

from orchestrator.intervals import mean, share, student_t

VALUES = st.lists(st.floats(-1e3, 1e3), min_size=2, max_size=9)


@pytest.mark.parametrize(
    ("freedom", "quantile"),  # NIST/SEMATECH e-Handbook of Statistical Methods, 1.3.6.7.2
    [
        (1, 12.706),
        (2, 4.303),
        (3, 3.182),
        (4, 2.776),
        (9, 2.262),
        (10, 2.228),
        (49, 2.010),
        (100, 1.984),
    ],
)
def test_quantiles_of_student_t_are_those_of_the_table(freedom: int, quantile: float) -> None:
    assert student_t(freedom) == pytest.approx(quantile, abs=5.1e-4)


def test_student_t_comes_down_to_the_normal_distribution() -> None:
    quantiles = [student_t(n) for n in (1, 2, 3, 10, 100, 1000, 20_000)]
    assert quantiles == sorted(quantiles, reverse=True)
    assert quantiles[-1] == pytest.approx(1.959964, abs=2e-4)


@given(VALUES, st.floats(-1e3, 1e3), st.floats(0.1, 10))
def test_the_interval_of_a_mean_moves_and_stretches_with_the_data(
    values: list[float], shift: float, scale: float
) -> None:
    before, after = mean(values), mean([scale * value + shift for value in values])
    for old, new in zip(
        (before.low, before.value, before.high), (after.low, after.value, after.high), strict=True
    ):
        assert old is not None
        assert new == pytest.approx(scale * old + shift, abs=1e-6)


def test_the_interval_of_a_mean_covers_it_in_95_percent_of_the_cases() -> None:
    samples = np.random.default_rng(1).normal(size=(40_000, 5))
    estimates = [mean(sample.tolist()) for sample in samples]
    covered = [e.low is not None and e.high is not None and e.low <= 0 <= e.high for e in estimates]
    deviation = np.sqrt(0.95 * 0.05 / len(samples))
    assert share(covered).value == pytest.approx(0.95, abs=3 * deviation)


def test_one_value_has_no_interval_and_one_success_a_wide_one() -> None:
    assert (mean([3.0]).value, mean([3.0]).low, mean([3.0]).high) == (3.0, None, None)
    estimate = share([True])  # z^2 = 3.8415: from 1 / (1 + z^2) to 1
    assert estimate.value == 1
    assert estimate.low == pytest.approx(1 / 4.8415, abs=1e-4)
    assert estimate.high == pytest.approx(1)


@given(st.integers(1, 10_000))
def test_what_never_happened_has_no_lower_bound_above_zero_and_the_opposite(n: int) -> None:
    assert share([False] * n).low == 0.0
    assert share([True] * n).high == 1.0
    assert share([False] * n).high == pytest.approx(_bound(n))
    assert share([True] * n).low == pytest.approx(1 - _bound(n))


def _bound(n: int) -> float:
    """Of Wilson's interval without a success: z^2 / (n + z^2)."""
    return 3.841458820694124 / (n + 3.841458820694124)
