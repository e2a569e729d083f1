"""Random numbers by counter, whose bits do not depend on the machine.

Native units have the same in C (`fmus/native/random_normal.h`). Additions, multiplications,
divisions and square roots of doubles are defined to the bit by IEEE 754; the logarithm is made of
them.
"""

from typing import Final

import numpy as np

from orchestrator.signal import Array

STRIDE: Final = 0x9E3779B97F4A7C15
"""2^64 / golden ratio: steps of a counter by it are far apart."""
_FACTORS: Final = (np.uint64(0xBF58476D1CE4E5B9), np.uint64(0x94D049BB133111EB))
_SHIFTS: Final = (np.uint64(30), np.uint64(27), np.uint64(31))
_HALF: Final = np.uint64(32)
_LOG_2: Final = (float.fromhex("0x1.62e42feep-1"), float.fromhex("0x1.a39ef35793c76p-33"))
"""The logarithm of 2 in two parts; the first has 32 bits, so that it is exact times an exponent."""


def mixed_bits(x: Array) -> Array:
    """A permutation of the 64-bit numbers in which every bit moves about half of the others.

    The finaliser of SplitMix64 (Steele, Lea and Flood, OOPSLA 2014; Stafford's variant 13).

    Args:
        x: uint64, any shape.

    Returns:
        uint64, of the shape of `x`.
    """
    x = (x ^ (x >> _SHIFTS[0])) * _FACTORS[0]
    x = (x ^ (x >> _SHIFTS[1])) * _FACTORS[1]
    mixed: Array = x ^ (x >> _SHIFTS[2])
    return mixed


def standard_normals(bits: Array) -> Array:
    """Numbers of the standard normal distribution.

    Of the upper 32 of the 64 bits: the quantile of the middle of their interval of width 2^-32
    (Wichura 1988, AS 241, routine PPND7: relative error 1e-7).

    Args:
        bits: random, uint64, any shape.

    Returns:
        Quantiles, float64, of the shape of `bits`.
    """
    p = ((bits >> _HALF).astype(np.float64) + 0.5) * 2.0**-32
    q = p - 0.5
    r = 0.180625 - q * q
    above = 3.3871327179 + r * (50.434271938 + r * (159.29113202 + r * 59.109374720))
    below = 1.0 + r * (17.895169469 + r * (78.757757664 + r * 67.187563600))
    tail = np.sqrt(-_logarithm(np.minimum(p, 1.0 - p))) - 1.6
    far = 1.4234372777 + tail * (2.7568153900 + tail * (1.3067284816 + tail * 0.17023821103))
    far = far / (1.0 + tail * (0.73700164250 + tail * 0.12021132975))
    return np.where(np.abs(q) <= 0.425, q * above / below, np.copysign(far, q))


def _logarithm(x: Array) -> Array:
    """The natural logarithm of normal positive doubles.

    x = 2^e m with m in [1 / sqrt 2, sqrt 2), and log m = 2 artanh z with |z| < 0.172; the terms of
    the series that are left out are below 2 z^25 / 25 = 6e-21.
    """
    m, exponent = np.frexp(x)  # m in [1/2, 1)
    is_low = m < np.sqrt(0.5)
    m, e = np.where(is_low, 2.0 * m, m), (exponent - is_low).astype(np.float64)
    z = (m - 1.0) / (m + 1.0)
    square, series = z * z, np.zeros_like(z)
    for power in range(23, 1, -2):
        series = (series + 1.0 / power) * square
    return np.asarray(e * _LOG_2[0] + (2.0 * z + (2.0 * z * series + e * _LOG_2[1])))
