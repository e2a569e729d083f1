"""Intervals of 95 %: tables and examples of books, and what shifting and stretching data does."""

import numpy as np
import pytest
from hypothesis import given, strategies as st

from orchestrator.intervals import differences, mean, paired_shares, share, student_t

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


@pytest.mark.parametrize(
    ("freedom", "level", "quantile"),  # the same table
    [(2, 0.99, 9.925), (10, 0.99, 3.169), (24, 0.998, 3.467), (24, 0.9, 1.711)],
)
def test_other_levels_have_the_quantiles_of_the_table(
    freedom: int, level: float, quantile: float
) -> None:
    assert student_t(freedom, level) == pytest.approx(quantile, abs=5.1e-4)


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


def pairs(both: int, first: int, second: int, neither: int) -> tuple[list[bool], list[bool]]:
    """So many pairs in which both are true, only the first is, only the second, none."""
    kinds = [(True, True)] * both + [(True, False)] * first
    kinds += [(False, True)] * second + [(False, False)] * neither
    return [a for a, _ in kinds], [b for _, b in kinds]


def test_the_interval_of_paired_shares_is_that_of_the_textbook() -> None:
    """Fagerland, Lydersen, Laake, Statistical Analysis of Contingency Tables, 2017, chapter 8.

    Complete response before and after consolidation therapy; the authors' package prints the
    interval of Newcombe so.
    """
    found = paired_shares(*pairs(59, 6, 16, 80))
    numbers = [found.value, found.low, found.high]
    assert numbers == pytest.approx([-0.0621, -0.1186, -0.0046], abs=5e-5)


COUNTS = st.lists(st.integers(0, 30), min_size=4, max_size=4).filter(any)


@given(COUNTS)
def test_paired_shares_the_other_way_round_are_the_negative(counts: list[int]) -> None:
    both, first, second, neither = counts
    there = paired_shares(*pairs(*counts))
    back = paired_shares(*pairs(both, second, first, neither))
    assert there.low is not None
    assert there.high is not None
    negative = [-there.value, -there.high, -there.low]
    assert [back.value, back.low, back.high] == pytest.approx(negative, abs=1e-12)
    assert -1 - 1e-12 <= there.low <= there.value <= there.high <= 1 + 1e-12


def test_pairs_that_never_differ_may_differ_some_day() -> None:
    """The half width for 20 pairs is the upper bound of none of 20, 16.1 %."""
    found = paired_shares([False] * 20, [False] * 20)
    assert (found.value, found.low, found.high) == pytest.approx((0, -0.1611, 0.1611), abs=5e-5)


def test_the_interval_of_paired_shares_covers_the_difference_in_95_percent_of_the_cases() -> None:
    """Of 40 pairs that agree mostly."""
    rng = np.random.default_rng(2)
    draws = rng.multinomial(40, [0.45, 0.10, 0.05, 0.40], size=4000)
    covered = 0
    for counts in draws.tolist():
        found = paired_shares(*pairs(*counts))
        covered += (
            found.low is not None and found.high is not None and found.low <= 0.05 <= found.high
        )
    assert covered / len(draws) == pytest.approx(0.95, abs=0.025)


def test_differences_are_of_seeds_that_both_have_in_their_order() -> None:
    assert differences({3: 1.0, 1: 5.0, 2: 4.0}, {1: 2.0, 3: 3.0, 9: 1.0}) == [3.0, -2.0]
