"""Numbers as they are written, without rounding."""

import math
from fractions import Fraction


def exact(text: str) -> Fraction:
    """The finite number that `text` is; one that float64 holds for zero is zero.

    So an exponent of millions of digits is no reason to compute for hours.

    Raises:
        ValueError: it is none.
    """
    try:
        rounded = float(text)
    except ValueError:
        raise ValueError(f"expected a number, got `{text[:40]}`") from None
    if not math.isfinite(rounded):
        raise ValueError(f"expected a finite number, got `{text[:40]}`")
    return Fraction(text.strip()) if rounded else Fraction(0)


def quotient(text: str) -> Fraction:
    """A number, as `exact`, or a whole one divided by another, such as `1/60`.

    Raises:
        ValueError: it is neither.
        ZeroDivisionError: the second one is zero.
    """
    return Fraction(text.strip()) if "/" in text else exact(text)
