"""Layers of a network whose results are the same bits on every machine.

Libraries for linear algebra add in whatever order suits the processor, and round after every
addition, so their results differ from machine to machine. Here weights and activations are
multiples of powers of two, and so few bits wide that every product and every sum is exact in
floating point: whatever the order, nothing is rounded but by the layer itself, at its end.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np

from orchestrator.signal import Array

WEIGHT_BITS: Final = 12
"""Weights are multiples of 2^-12."""
ACTIVATION_BITS: Final = 8
"""Activations are multiples of 2^-8."""
LARGEST: Final = 64.0
"""Activations are at most this, and at least its negative."""

_STEPS: Final = float(2**ACTIVATION_BITS)
_EXACT: Final = 2.0 ** (53 - WEIGHT_BITS - ACTIVATION_BITS)
_EXACT_SINGLE: Final = 2.0 ** (24 - WEIGHT_BITS)


def rounded(values: Array) -> Array:
    """Values rounded to the nearest activation, halves to even; of any shape, which stays.

    Zero is positive: of a sum that is zero the sign depends on the order, and of a maximum of both
    zeros on the processor.
    """
    steps = np.asarray(np.clip(values, -LARGEST, LARGEST))  # in place: memory takes longest
    steps *= _STEPS
    np.rint(steps, out=steps)
    steps *= 1.0 / _STEPS
    steps += 0.0
    return steps


def rounded_weights(values: Array) -> Array:
    """Values rounded to the nearest weight, halves to even; float64, of any shape, which stays."""
    return np.rint(np.asarray(values, np.float64) * 2.0**WEIGHT_BITS) / 2.0**WEIGHT_BITS


def _check(reach: Array, bound: float) -> None:
    """Refuse a layer; `reach` is what the sums of its outputs can come to, shape (output,)."""
    if not (reach < bound).all():
        output = int(np.flatnonzero(~(reach < bound))[0])
        raise ValueError(
            f"weights are not finite, or too large to be added exactly: the sums of output "
            f"{output} reach {reach[output]:g}, and must stay below {bound:g}"
        )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Dense:
    """A layer: weighted sums of its inputs and a bias, exact, then rounded to activations.

    Attributes:
        weight: shape (input, output).
        bias: shape (output,).
    """

    weight: Array
    bias: Array

    @classmethod
    def of(cls, weight: Array, bias: Array) -> "Dense":
        """The layer with the nearest numbers that the fixed point has.

        Args:
            weight: any numbers, shape (input, output).
            bias: any numbers, shape (output,).

        Raises:
            ValueError: a number is not finite, or sums of them could not be exact.
        """
        layer = cls(weight=rounded_weights(weight), bias=rounded_weights(bias))
        reach = LARGEST * np.abs(layer.weight).sum(axis=0) + np.abs(layer.bias)
        _check(reach, _EXACT)
        return layer

    def __call__(self, inputs: Array) -> Array:
        """The outputs, shape (..., output), for activations of shape (..., input)."""
        sums = inputs @ self.weight
        sums += self.bias
        return rounded(sums)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class BinaryDense:
    """A layer whose inputs are 0 or 1: exact in single precision, which is twice as fast.

    Attributes:
        weight: float32, shape (input, output).
    """

    weight: Array

    @classmethod
    def of(cls, weight: Array) -> "BinaryDense":
        """The layer with the nearest numbers that the fixed point has.

        Args:
            weight: any numbers, shape (input, output).

        Raises:
            ValueError: a number is not finite, or sums of them could not be exact.
        """
        nearest = rounded_weights(weight)
        _check(np.abs(nearest).sum(axis=0), _EXACT_SINGLE)
        return cls(weight=nearest.astype(np.float32))

    def __call__(self, inputs: Array) -> Array:
        """The sums for zeros and ones, not yet rounded.

        Args:
            inputs: zeros and ones, float32, shape (..., input).

        Returns:
            Sums, float64, shape (..., output).
        """
        return np.asarray(inputs @ self.weight, np.float64)


def rectified(values: Array) -> Array:
    """The values with 0 instead of negative ones; of any shape, which stays."""
    return np.maximum(values, 0.0)
