"""Sums in fixed point: exact, whatever the order, the library and the precision."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from fmus.driving.network.fixed_point import (
    ACTIVATION_BITS,
    LARGEST,
    WEIGHT_BITS,
    BinaryDense,
    Dense,
    rectified,
    rounded,
    rounded_weights,
)
from orchestrator.signal import Array

FINITE = st.floats(allow_nan=False, allow_infinity=False, width=64)
HIGHEST = int(LARGEST) << ACTIVATION_BITS
LIMIT = 2.0 ** (53 - WEIGHT_BITS - ACTIVATION_BITS)
"""What sums must stay below, so that all multiples of 2^-20 are there."""


def of_integers(inputs: Array, weight: Array, bias: Array) -> Array:
    """What `Dense` has to give, in integers of any size; units 2^-8, 2^-12 and 2^-12."""
    sums = inputs.astype(object) @ weight.astype(object) + bias.astype(object) * 2**ACTIVATION_BITS
    steps = [
        min(max(round(Fraction(int(total), 2**WEIGHT_BITS)), -HIGHEST), HIGHEST)
        for total in np.atleast_1d(sums).tolist()
    ]
    return np.array(steps, float) / 2**ACTIVATION_BITS


@given(seed=st.integers(0, 2**32 - 1), width=st.integers(1, 300), bits=st.integers(1, 24))
@settings(max_examples=60, deadline=None)
def test_a_layer_is_exact_arithmetic_rounded_once(seed: int, width: int, bits: int) -> None:
    rng = np.random.default_rng(seed)
    inputs = rng.integers(-HIGHEST, HIGHEST, width, endpoint=True)
    weight = rng.integers(-(2**bits), 2**bits, (width, 3))
    bias = rng.integers(-(2**bits), 2**bits, 3)
    layer = Dense.of(weight / 2**WEIGHT_BITS, bias / 2**WEIGHT_BITS)
    expected = of_integers(inputs, weight, bias)
    found = layer(inputs / 2**ACTIVATION_BITS)
    assert found.tobytes() == expected.tobytes()
    order = rng.permutation(width)
    turned_round = Dense(weight=layer.weight[order], bias=layer.bias)
    assert turned_round(inputs[order] / 2**ACTIVATION_BITS).tobytes() == expected.tobytes()


@given(seed=st.integers(0, 2**32 - 1), bits=st.integers(1, 16))
@settings(max_examples=40, deadline=None)
def test_single_precision_is_exact_for_zeros_and_ones(seed: int, bits: int) -> None:
    rng = np.random.default_rng(seed)
    inputs = rng.integers(0, 2, (7, 200))
    weight = rng.integers(-(2**bits), 2**bits, (200, 5))
    found = BinaryDense.of(weight / 2**WEIGHT_BITS)(inputs.astype(np.float32))
    assert (found == (inputs @ weight) / 2**WEIGHT_BITS).all()
    order = rng.permutation(200)
    moved = BinaryDense.of(weight[order] / 2**WEIGHT_BITS)
    assert (moved(inputs[:, order].astype(np.float32)) == found).all()


def test_sums_are_exact_up_to_the_bound_and_refused_from_there() -> None:
    most = (LIMIT - 2.0**-WEIGHT_BITS) / LARGEST  # not a weight yet: one step of the bias is left
    step = 2.0**-WEIGHT_BITS
    weight = np.array([[most], [0.0]]) // step * step
    layer = Dense.of(weight, np.zeros(1))
    assert float((np.array([LARGEST, 0.0]) @ layer.weight)[0]) == LARGEST * weight[0, 0]
    with pytest.raises(ValueError, match=r"the sums of output 1 reach 8.58993e\+09, and must stay"):
        Dense.of(np.array([[0.0, LIMIT / LARGEST]]), np.zeros(2))
    with pytest.raises(ValueError, match=r"output 0 reach 4096, and must stay below 4096"):
        BinaryDense.of(np.full((4096, 1), 1.0))
    assert BinaryDense.of(np.full((4095, 1), 1.0))(np.ones(4095, np.float32)) == [4095.0]


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_weights_that_are_not_finite_are_refused(value: float) -> None:
    with pytest.raises(ValueError, match="weights are not finite, or too large"):
        Dense.of(np.array([[value]]), np.zeros(1))
    with pytest.raises(ValueError, match="weights are not finite, or too large"):
        Dense.of(np.zeros((1, 1)), np.array([value]))
    with pytest.raises(ValueError, match="weights are not finite, or too large"):
        BinaryDense.of(np.array([[value]]))


@given(first=FINITE, second=FINITE)
def test_rounding_is_idempotent_monotone_odd_and_bounded(first: float, second: float) -> None:
    low, high = rounded(np.array(sorted([first, second]))).tolist()
    assert -LARGEST <= low <= high <= LARGEST
    assert rounded(np.array([low, high])).tolist() == [low, high]
    assert rounded(np.array([-first]))[0] == -rounded(np.array([first]))[0]
    if abs(first) <= LARGEST:
        assert abs(rounded(np.array([first]))[0] - first) <= 0.5 * 2.0**-ACTIVATION_BITS


def test_halves_go_to_even() -> None:
    steps = np.array([0.5, 1.5, 2.5, -0.5, -1.5])
    assert (rounded(steps * 2.0**-ACTIVATION_BITS) * 2**ACTIVATION_BITS == [0, 2, 2, 0, -2]).all()
    assert (rounded_weights(steps * 2.0**-WEIGHT_BITS) * 2**WEIGHT_BITS == [0, 2, 2, 0, -2]).all()


def test_no_zero_is_negative() -> None:
    """The sign of a sum that is zero depends on the order: the bits must not."""
    zeros = np.array([-0.0, -1e-9, 0.0, 1e-9])
    assert not np.signbit(rounded(zeros)).any()
    layer = Dense.of(np.array([[-1.0], [-1.0]]), np.array([-1e-9]))
    assert not np.signbit(layer(np.zeros((3, 2)))).any()
    assert not np.signbit(rectified(layer(np.ones((3, 2))))).any()
