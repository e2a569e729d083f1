"""Communication points as the engine counts them."""

from fractions import Fraction
from typing import Final

import numpy as np

from orchestrator.plan import layouts
from orchestrator.signal import Array
from orchestrator.timebase import CommunicationGrid, Time

_EXACT: Final = 1 << 53
"""Whole numbers up to this are exact as float64."""


def is_countable(grid: CommunicationGrid) -> bool:
    """Whether all numbers that the engine makes of the points of a run are exact."""
    denominator = Fraction(grid.step_size).denominator
    return max(abs(grid.start), abs(grid.stop)) * denominator < _EXACT or denominator == 1


def grid_of(grid: CommunicationGrid) -> layouts.Grid:
    """The points in the memory of the engine."""
    step = Fraction(grid.step_size)
    return layouts.Grid(grid.start, step.numerator, step.denominator)


def points(grid: CommunicationGrid, t: Time, count: int) -> Array:
    """The first points behind `t` [ns], int64, shape (count,)."""
    step, first = Fraction(grid.step_size), grid.last(t) + 1
    numbers = first + np.arange(count, dtype=np.int64)
    if step.denominator == 1:
        return np.asarray(grid.start + step.numerator * numbers)
    doubled = 2 * step.numerator * numbers + step.denominator
    return np.asarray(grid.start + doubled // (2 * step.denominator))
