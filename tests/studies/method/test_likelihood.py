"""Fits of two parameters, against a search of all of them."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from studies.method.likelihood import deviance, logistic, straight

X = np.linspace(0.0, 1.0, 5)
N = np.full(5, 40.0)
COUNTS = st.lists(st.integers(0, 40), min_size=5, max_size=5).map(lambda k: np.array(k, float))


@pytest.mark.slow
@given(COUNTS)
@settings(max_examples=40, deadline=None)
def test_no_straight_line_on_a_grid_is_likelier(hits: np.ndarray) -> None:
    found = deviance(hits, N, straight(X, hits, N))
    ends = np.linspace(0.0, 1.0, 41)
    others = [deviance(hits, N, (1 - X) * a + X * b) for a in ends for b in ends]
    assert found <= min(other for other in others if not np.isnan(other)) + 1e-3


@pytest.mark.slow
@given(COUNTS)
@settings(max_examples=40, deadline=None)
def test_no_logistic_curve_on_a_grid_is_likelier(hits: np.ndarray) -> None:
    found = deviance(hits, N, logistic(X, hits, N))
    grid = np.linspace(-12.0, 12.0, 49)
    others = [deviance(hits, N, 1 / (1 + np.exp(-(a + b * X)))) for a in grid for b in grid]
    assert found <= min(others) + 1e-6


def test_counts_on_a_line_or_a_logistic_curve_miss_nothing() -> None:
    line = 1000.0 * (0.1 + 0.5 * X)
    curve = 1000.0 / (1.0 + np.exp(-(-3.0 + 5.0 * X)))
    trials = np.full(5, 1000.0)
    assert deviance(line, trials, straight(X, line, trials)) == pytest.approx(0.0, abs=1e-6)
    assert deviance(curve, trials, logistic(X, curve, trials)) == pytest.approx(0.0, abs=1e-6)


def test_the_deviance_of_shares_against_themselves_is_zero_and_else_positive() -> None:
    hits = np.array([0.0, 3.0, 40.0])
    assert deviance(hits, N[:3], hits / N[:3]) == 0.0
    assert deviance(hits, N[:3], np.array([0.1, 0.1, 0.9])) > 0.0


@pytest.mark.parametrize("hits", [np.zeros(5), N])
def test_nothing_and_everything_are_straight(hits: np.ndarray) -> None:
    assert deviance(hits, N, straight(X, hits, N)) == pytest.approx(0.0, abs=1e-6)
