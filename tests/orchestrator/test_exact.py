"""Numbers without rounding, and without hours of arithmetic."""

import sys
from fractions import Fraction

import pytest
from hypothesis import given, strategies as st

from orchestrator.exact import exact, quotient
from orchestrator.timebase import nanoseconds


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_a_number_is_what_is_written(number: float) -> None:
    assert exact(f" {number!r} ") == Fraction(repr(number))
    assert exact(f"{number!r}") == quotient(f"{number!r}")


@given(st.integers(), st.integers(min_value=1))
def test_a_quotient_is_exact(above: int, below: int) -> None:
    whole = abs(above) < sys.float_info.max > below
    if whole:
        assert quotient(f"{above}/{below}") == Fraction(above, below)


def test_exponents_of_millions_of_digits_are_no_work() -> None:
    for text in ("1e-400000000", "-1e-400000000", "0e400000000"):
        assert exact(text) == nanoseconds(text) == 0
    with pytest.raises(ValueError, match="expected a finite number, got `1e400000000`"):
        exact("1e400000000")


@pytest.mark.parametrize("text", ["", "x", "1/2", "nan", "inf", "1e400"])
def test_what_is_no_number_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match=r"expected a (finite )?number, got `"):
        exact(text)


def test_nothing_divides_by_zero() -> None:
    with pytest.raises(ZeroDivisionError):
        quotient("1/0")
