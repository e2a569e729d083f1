"""One step over a span is as good as several over its parts."""

import numpy as np
import pytest
from hypothesis import given, strategies as st

from fmus.localisation.gauss_markov import DECAY, Transition, transition
from orchestrator.signal import Array

SPANS = st.integers(1, 5_000_000_000)
CORRELATION = 700_000_000  # [ns]


def keeps(step: Transition) -> Array:
    return np.array(step.keeps)


def added(step: Transition) -> Array:
    """The covariance of what is new."""
    root = np.array(step.adds)
    return np.asarray(root @ root.T)


@given(SPANS, SPANS)
def test_two_steps_are_one(first: int, second: int) -> None:
    """What is kept multiplies, and the covariance of what is new goes on with the process."""
    a, b, whole = (transition(t, CORRELATION) for t in (first, second, first + second))
    np.testing.assert_allclose(keeps(b) @ keeps(a), keeps(whole), rtol=0, atol=1e-14)
    later = keeps(b) @ added(a) @ keeps(b).T + added(b)
    np.testing.assert_allclose(later, added(whole), rtol=0, atol=1e-14)


@given(SPANS)
def test_variances_stay(span: int) -> None:
    step = transition(span, CORRELATION)
    kept = keeps(step) @ keeps(step).T
    np.testing.assert_allclose(kept + added(step), np.eye(2), rtol=0, atol=1e-14)


def test_the_autocorrelation_is_one_over_e_after_the_correlation_time() -> None:
    assert keeps(transition(CORRELATION, CORRELATION))[0, 0] == pytest.approx(np.exp(-1), abs=1e-15)


def test_the_slope_is_the_derivative() -> None:
    """For a short time the error goes on straight, and what is new is of third order."""
    span = CORRELATION // 1000
    s = float(DECAY) * span / CORRELATION
    step = transition(span, CORRELATION)
    assert step.keeps[0] == pytest.approx((1 - s * s / 2, s), rel=0.01 * s + 2 * s)
    assert added(step)[0, 0] == pytest.approx(4 * s**3 / 3, rel=3 * s)
    assert added(step)[1, 1] == pytest.approx(4 * s, rel=3 * s)


@pytest.mark.parametrize(("span", "correlation"), [(0, 1), (1, 10**15), (10**18, 1)])
def test_the_shortest_and_the_longest(span: int, correlation: int) -> None:
    """Nothing is lost in rounding, and nothing becomes a NaN."""
    step = transition(span, correlation)
    expected = np.eye(2) if span == 0 else np.zeros((2, 2)) if correlation == 1 else None
    if expected is not None:
        np.testing.assert_array_equal(keeps(step), expected)
        np.testing.assert_array_equal(added(step), np.eye(2) - expected)
    else:
        s = float(DECAY) * span / correlation
        assert step.adds[0][0] ** 2 == pytest.approx(4 * s**3 / 3, rel=1e-12)
