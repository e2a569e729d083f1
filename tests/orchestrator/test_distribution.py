"""Distributions: their draws lie within bounds, follow their law, and take what they say."""

import numpy as np
import pytest
from hypothesis import given, strategies as st

from orchestrator.distribution import (
    Choice,
    Constant,
    DistributedText,
    Distribution,
    Normal,
    Uniform,
)
from tests.orchestrator.test_structured_parameters import DISTRIBUTIONS

FINITE = st.floats(-1e300, 1e300)
SEEDS = st.integers(0, 2**32)


def generators(seed: int) -> tuple[np.random.Generator, np.random.Generator]:
    """Two that give the same numbers."""
    return np.random.default_rng(seed), np.random.default_rng(seed)


@given(DISTRIBUTIONS, SEEDS)
def test_draws_lie_within_the_bounds_and_repeat(distribution: Distribution, seed: int) -> None:
    rng, again = generators(seed)
    draws = [distribution.draw(rng) for _ in range(20)]
    assert all(distribution.lowest <= drawn <= distribution.highest for drawn in draws)
    assert draws == [distribution.draw(again) for _ in range(20)]
    assert not distribution.is_constant or len(set(draws)) == 1


@given(st.lists(FINITE, min_size=2, max_size=2, unique=True).map(sorted), SEEDS)
def test_rounding_never_leaves_the_interval(bounds: list[float], seed: int) -> None:
    low, high = bounds
    assert low <= Uniform(low, high).draw(np.random.default_rng(seed)) <= high


@given(FINITE, SEEDS)
def test_a_constant_draws_nothing(value: float, seed: int) -> None:
    rng, untouched = generators(seed)
    assert Constant(value).draw(rng) == value
    assert DistributedText(("car",)).draw(rng) == "car"
    assert rng.random() == untouched.random()


@given(st.floats(-1e3, 1e3), st.floats(0, 1e3), SEEDS)
def test_a_uniform_draw_is_made_of_the_middle_and_the_half_width(
    low: float, width: float, seed: int
) -> None:
    high = low + width
    rng, other = generators(seed)
    expected = (low + high) / 2 + (high - low) / 2 * other.uniform(-1.0, 1.0)
    assert Uniform(low, high).draw(rng) == min(max(expected, low), high)
    assert rng.random() == other.random()


@pytest.mark.parametrize(
    ("distribution", "mean", "deviation"),
    [
        (Uniform(2.0, 8.0), 5.0, 6.0 / np.sqrt(12)),
        (Normal(5.0, 2.0), 5.0, 2.0),
        # half a normal distribution: mean and deviation in closed form
        (Normal(0.0, 1.0, 0.0), np.sqrt(2 / np.pi), np.sqrt(1 - 2 / np.pi)),
        (Choice((1.0, 3.0)), 2.0, 1.0),
        (Choice((0.0, 1.0), (1.0, 3.0)), 0.75, np.sqrt(3 / 16)),
    ],
)
def test_draws_follow_the_law(distribution: Distribution, mean: float, deviation: float) -> None:
    rng = np.random.default_rng(1)
    draws = np.array([distribution.draw(rng) for _ in range(20_000)])
    assert draws.mean() == pytest.approx(mean, abs=4 * deviation / np.sqrt(len(draws)))
    assert draws.std() == pytest.approx(deviation, rel=0.03)


def test_texts_are_drawn_by_weight() -> None:
    rng = np.random.default_rng(1)
    texts = DistributedText(("car", "truck"), (1.0, 3.0))
    draws = [texts.draw(rng) for _ in range(20_000)]
    assert draws.count("truck") / len(draws) == pytest.approx(0.75, abs=0.0125)
    assert not texts.is_constant


def test_distributions_are_values() -> None:
    assert Uniform(1.0, 2.0) == Uniform(1.0, 2.0)
    assert len({Normal(1.0, 2.0), Normal(1.0, 2.0), Constant(1.0), Choice((1.0,))}) == 3
