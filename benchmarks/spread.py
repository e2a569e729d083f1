"""The median of repetitions, and how far they are apart."""

import statistics
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Self


@dataclass(frozen=True, slots=True, kw_only=True)
class Spread:
    """Attributes: the median, the smallest and the largest of some numbers."""

    median: float
    low: float
    high: float

    @classmethod
    def of(cls, numbers: Iterable[float]) -> Self:
        """The spread of at least one number."""
        found = sorted(numbers)
        return cls(median=statistics.median(found), low=found[0], high=found[-1])
