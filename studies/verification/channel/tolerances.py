"""How far the channel may differ from golden data.

The tolerances ask for an implementation of the same formulas, not for a similar channel.
"""

from dataclasses import dataclass
from typing import Final


@dataclass(frozen=True, slots=True)
class Tolerance:
    """How far two values may lie apart.

    Attributes:
        limit: the largest difference that passes, in `unit`.
        unit: `dB`, `1` or `sigma`.
        source: why it is so large.
    """

    limit: float
    unit: str
    source: str


LOSS: Final = Tolerance(
    1e-6, "dB", "golden losses have 12 significant digits, and inputs are exact as written"
)
PROBABILITY: Final = Tolerance(
    1e-9, "1", "golden probabilities have 17 digits; binary exponents of 1 - p lose some of them"
)
SNIR: Final = Tolerance(1e-6, "dB", "golden SNIR has 15 significant digits")
STACK_POWER: Final = Tolerance(
    1e-3, "dB", "recorded positions are rounded to 1e-6 m, and received powers to 1e-4 dB"
)
STACK_SNIR: Final = Tolerance(
    1e-3, "dB", "as the received power; recorded times are rounded to 1 ns, of which Veins has 1000"
)
COUNT: Final = Tolerance(
    4.0, "sigma", "a count of independent draws against the sum of their probabilities"
)
FADING: Final = Tolerance(
    5.0,
    "sigma",
    "sampling error of both sides; some 200 values are compared, of which 4 sigma would refuse "
    "one in every hundred runs by mere chance, 5 sigma one in ten thousand",
)
TOTALS: Final = Tolerance(
    5.0,
    "sigma",
    "Veins is one more run beside those of other seeds; with 20 seeds, Student's t with 19 degrees "
    "of freedom exceeds 5 in 8 of 100 000 cases",
)
SEEDS: Final = 20
"""Runs with a medium access of our own."""
