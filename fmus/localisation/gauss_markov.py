"""The stationary Gauss-Markov process of second order, in its exact discretisation.

A. Gelb, Applied Optimal Estimation, 1974, table 2.2-1: e'' + 2 b e' + b^2 e = white noise, so that
the autocorrelation is (1 + b |t|) exp(-b |t|), and 1 / e after 2.146 / b. Unlike the process of
first order it has a velocity, of the standard deviation b: navigation filters do not jump.
"""

import functools
from dataclasses import dataclass
from decimal import Context, Decimal, localcontext
from typing import Final, TypeAlias

from orchestrator.timebase import Duration

Matrix: TypeAlias = tuple[tuple[float, float], tuple[float, float]]

DECAY: Final = Decimal("2.1461932206205825")
"""The root of (1 + x) exp(-x) = 1 / e."""
_DIGITS: Final = Context(prec=60)


@dataclass(frozen=True, slots=True)
class Transition:
    """From one point of time to the next: x' = keeps x + adds w, w standard normal, shape (2,).

    x has the error and its slope, each divided by its own standard deviation.

    Attributes:
        keeps: what is left of x, rows first.
        adds: the square root of what is new, a lower triangle.
    """

    keeps: Matrix
    adds: Matrix


@functools.lru_cache(maxsize=256)
def transition(span: Duration, correlation: Duration) -> Transition:
    """The step over `span`.

    With s = b t: keeps = exp(-s) ((1 + s, s), (-s, 1 - s)), and adds adds^T = 1 - keeps keeps^T, of
    which the first element is 4 s^3 / 3 for small s: calculated with 60 digits, which are the same
    on every machine, and rounded.

    Args:
        span: not negative [ns].
        correlation: after which the autocorrelation is 1 / e, positive [ns].
    """
    with localcontext(_DIGITS):
        s = DECAY * Decimal(span) / Decimal(correlation)
        left = (-s).exp()
        squared = left * left
        value = 1 - squared * (1 + 2 * s + 2 * s * s)
        both = 2 * s * s * squared
        slope = 1 - squared * (1 - 2 * s + 2 * s * s)
        first = value.sqrt() if value > 0 else Decimal(0)
        second = both / first if first else Decimal(0)
        rest = slope - second * second
        third = rest.sqrt() if rest > 0 else Decimal(0)
        return Transition(
            keeps=(
                (float(left * (1 + s)), float(left * s)),
                (float(-left * s), float(left * (1 - s))),
            ),
            adds=((float(first), 0.0), (float(second), float(third))),
        )
