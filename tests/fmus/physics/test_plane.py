"""Frames in the plane against the mathematics of them."""

import cmath
import hashlib
import math
import struct
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from fmus.physics.plane import Frame, cosine_sine, turned, turned_back

ANGLES = st.floats(-10.0, 10.0)
LENGTHS = st.floats(-1e3, 1e3)
FRAMES = st.builds(Frame, x=LENGTHS, y=LENGTHS, heading=ANGLES)


@given(angle=ANGLES)
def test_cosine_and_sine_are_those_of_mathematics(angle: float) -> None:
    cosine, sine = cosine_sine(angle)
    assert cosine == pytest.approx(math.cos(angle), abs=2e-15, rel=0)
    assert sine == pytest.approx(math.sin(angle), abs=2e-15, rel=0)


@given(angle=st.floats(-1e6, 1e6))
def test_many_turns_cost_few_digits(angle: float) -> None:
    cosine, sine = cosine_sine(angle)
    assert abs(complex(cosine, sine) - cmath.exp(1j * angle)) < 2e-10


@given(rest=st.floats(-math.pi / 4, math.pi / 4))
def test_the_series_are_evaluated_to_two_units_in_the_last_place(rest: float) -> None:
    """Below an eighth of a turn nothing is reduced: the sums of the series, in fractions."""
    exact = Fraction(rest)
    sine = sum((-1) ** k * exact ** (2 * k + 1) / math.factorial(2 * k + 1) for k in range(14))
    cosine = sum((-1) ** k * exact ** (2 * k) / math.factorial(2 * k) for k in range(14))
    found = cosine_sine(rest)
    assert abs(Fraction(found[0]) - cosine) <= 2 * Fraction(math.ulp(float(cosine)))
    assert abs(Fraction(found[1]) - sine) <= 2 * Fraction(math.ulp(float(sine)))


def test_their_bits_are_the_same_everywhere() -> None:
    """Only additions and multiplications: this hash holds for every machine and C library."""
    values = [number for k in range(-4000, 4000) for number in cosine_sine(k * 0.0017)]
    digest = hashlib.sha256(struct.pack(f"<{len(values)}d", *values)).hexdigest()
    assert digest == "da572fb59c8292cd89360e34d2ec580de7498b7ed41cc3b276d4683cf93fe801"


@pytest.mark.parametrize("quarters", range(-8, 9))
def test_quarter_turns_are_exact(quarters: int) -> None:
    whole = [(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)][quarters % 4]
    assert cosine_sine(quarters * (math.pi / 2.0)) == whole


@given(x=LENGTHS, y=LENGTHS, angle=ANGLES)
def test_vectors_turn_as_complex_numbers_do(x: float, y: float, angle: float) -> None:
    found_x, found_y = turned(np.array([x]), np.array([y]), angle)
    assert abs(complex(found_x[0], found_y[0]) - complex(x, y) * cmath.exp(1j * angle)) < 1e-11
    back = turned_back(float(found_x[0]), float(found_y[0]), angle)
    assert abs(complex(*back) - complex(x, y)) < 1e-11


@given(one=FRAMES, other=FRAMES, x=LENGTHS, y=LENGTHS)
def test_points_change_frames_as_complex_numbers_do(
    one: Frame, other: Frame, x: float, y: float
) -> None:
    world = complex(one.x, one.y) + complex(x, y) * cmath.exp(1j * one.heading)
    expected = (world - complex(other.x, other.y)) * cmath.exp(-1j * other.heading)
    found_x, found_y = one.to(other, np.array([x]), np.array([y]))
    assert abs(complex(found_x[0], found_y[0]) - expected) < 2e-11


@given(one=FRAMES, other=FRAMES, third=FRAMES, seed=st.integers(0, 1000))
@settings(max_examples=50)
def test_frames_are_a_group(one: Frame, other: Frame, third: Frame, seed: int) -> None:
    x, y = np.random.default_rng(seed).uniform(-50, 50, (2, 20))
    there = one.to(other, x, y)
    np.testing.assert_allclose(other.to(one, *there), (x, y), atol=1e-11, rtol=0)
    np.testing.assert_allclose(other.to(third, *there), one.to(third, x, y), atol=1e-11, rtol=0)
    assert all((a == b).all() for a, b in zip(one.to(one, x, y), (x, y), strict=True))
    assert one.turn(other) + other.turn(third) == pytest.approx(one.turn(third), abs=1e-14)
