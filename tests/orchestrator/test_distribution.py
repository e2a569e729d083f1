"""Distributions: their draws lie within bounds, follow their law, and take what they say."""

import math
import re
from collections.abc import Callable
from statistics import NormalDist
from typing import cast

import numpy as np
import pytest
from hypothesis import given, strategies as st

from orchestrator.distribution import (
    LEAST_MASS,
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


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Uniform(2.0, 1.0), "the lower bound 2 is above the upper bound 1"),
        (lambda: Normal(0.0, 0.0), "the deviation 0 is not positive"),
        (lambda: Normal(0.0, -1.0), "the deviation -1 is not positive"),
        (lambda: Normal(0.0, math.nan), "the deviation nan is not positive"),
        (lambda: Normal(0.0, 1.0, 2.0, 1.0), "the bound `low`, 2, is above `high`, 1"),
        (lambda: Normal(0.0, 1.0, 3.0), "only 0.0013 is between 3 and inf"),
        (lambda: Normal(0.0, 1.0, 1.0, 1.0), "only 0 is between 1 and 1"),
        (lambda: Choice(()), "there is nothing to choose from"),
        (lambda: DistributedText(()), "there is nothing to choose from"),
        (lambda: Choice((1.0, 2.0), (1.0,)), "1 weights do not fit 2 values"),
        (lambda: DistributedText(("a",), (1.0, 2.0)), "2 weights do not fit 1 values"),
        (lambda: Choice((1.0, 2.0), (1.0, 0.0)), "weights must be positive"),
        (lambda: DistributedText(("a", "b"), (-1.0, 1.0)), "weights must be positive"),
    ],
)
def test_what_is_no_distribution_is_refused(make: Callable[[], object], message: str) -> None:
    with pytest.raises(ValueError, match=re.escape(message)):
        make()


def test_bounds_are_inclusive_and_may_be_one() -> None:
    """Between the `LEAST_MASS` of a normal distribution and less of it lies the refusal."""
    assert Uniform(2.0, 2.0).draw(np.random.default_rng(1)) == 2.0
    at = NormalDist().inv_cdf(1.0 - LEAST_MASS)
    assert Normal(0.0, 1.0, at - 1e-6).draw(np.random.default_rng(1)) >= at - 1e-6
    with pytest.raises(ValueError, match="too little to draw from"):
        Normal(0.0, 1.0, at + 1e-6)


def test_texts_that_are_all_the_same_are_constant() -> None:
    assert DistributedText(("car", "car")).is_constant
    assert DistributedText(("car",)).is_constant


class Drawn:
    """Stands in for a generator: `random` gives this number."""

    def __init__(self, number: float) -> None:
        self._number = number

    def random(self) -> float:
        return self._number


@pytest.mark.parametrize(
    ("number", "index"), [(0.0, 0), (0.2499, 0), (0.25, 1), (0.7499, 1), (0.75, 2), (0.9999, 2)]
)
def test_values_are_drawn_by_inversion(number: float, index: int) -> None:
    """Of the weights 1, 2, 1: each value has the numbers from its lower limit to below the next."""
    values = ("a", "b", "c")
    texts = DistributedText(values, (1.0, 2.0, 1.0))
    assert texts.draw(cast("np.random.Generator", Drawn(number))) == values[index]


def test_a_product_that_rounds_up_to_the_last_limit_still_gives_the_last_value() -> None:
    """Of subnormal weights: the largest number below 1 times the limit is the limit."""
    weights = (5e-324, 5e-324)
    largest = cast("np.random.Generator", Drawn(math.nextafter(1.0, 0.0)))
    assert Choice((1.0, 2.0), weights).draw(largest) == 2.0
