"""Does a quantity with an interval of 95 % satisfy a claim? The rule, and nothing else."""

import enum
import math
from collections.abc import Sequence
from dataclasses import dataclass

from orchestrator.intervals import Estimate


class Part(enum.Enum):
    """What is known of one comparison that a claim consists of."""

    HOLDS = "holds"
    """The whole interval satisfies it."""

    FAILS = "fails"
    """The whole interval violates it."""

    OPEN = "open"
    """The interval reaches to both sides, or there is none."""


class Verdict(enum.Enum):
    """What has become of a claim."""

    REPRODUCED = "reproduced"
    PARTLY = "partly reproduced"
    REFUTED = "not reproduced"
    UNDECIDED = "undecided"


@dataclass(frozen=True, slots=True, kw_only=True)
class Range:
    """The values that satisfy a comparison.

    Attributes:
        low, high: the bounds.
        is_open: whether the bounds do not belong to it: "more than" rather than "at least".
    """

    low: float = -math.inf
    high: float = math.inf
    is_open: bool = False

    def has(self, value: float) -> bool:
        """Whether `value` satisfies the comparison."""
        if self.is_open:
            return self.low < value < self.high
        return self.low <= value <= self.high

    def judge(self, found: Estimate | None) -> Part:
        """Whether the interval lies within, outside, or across a bound."""
        if found is None or found.low is None or found.high is None:
            return Part.OPEN
        if self.has(found.low) and self.has(found.high):
            return Part.HOLDS
        below, above = found.high, found.low  # the ends next to the range
        is_outside = below < self.low or above > self.high
        if self.is_open:
            is_outside = below <= self.low or above >= self.high
        return Part.FAILS if is_outside else Part.OPEN


def verdict(parts: Sequence[Part]) -> Verdict:
    """Of a claim with at least one part.

    Reproduced if every part holds, partly if some do; not reproduced if none holds and one fails;
    else undecided.
    """
    holding = sum(part is Part.HOLDS for part in parts)
    if holding:
        return Verdict.REPRODUCED if holding == len(parts) else Verdict.PARTLY
    return Verdict.REFUTED if Part.FAILS in parts else Verdict.UNDECIDED
