"""Numbers that look valid and are not usual, and such that are not valid."""

from typing import Final

import numpy as np

from fmus.native.interface import Variable
from orchestrator.signal import Array

_WHOLE: Final = {
    "Int8", "UInt8", "Int16", "UInt16", "Int32", "UInt32", "Int64", "UInt64", "Boolean",
    "Enumeration",
}  # fmt: skip

HOSTILE: Final = (
    float("nan"), float("inf"), float("-inf"), -1.0, 0.0, -0.0, 1e308, -1e308, 5e-324, 1e19,
    2.0**31, -(2.0**31) - 1, 2.0**32, 2.0**62, 2.0**63, 1e9, -1e9, 4e9, 1e300,
)  # fmt: skip

_MOST: Final = {
    # one step of a matrix, a fan or a queue of the largest size takes seconds under sanitizers
    "rows": 96, "columns": 96, "azimuths": 128, "channels": 32, "window_largest": 64,
    "window_smallest": 16, "index_levels": 255, "threads": 3, "n_blind_zone": 64, "n_sharer": 20,
    "n_probe": 30, "n_antenna_gain": 40,
}  # fmt: skip


def bounds(variable: Variable) -> tuple[float, float]:
    """The least and the largest value that is tried as a valid one."""
    if variable.items:
        return 1, len(variable.items)
    if variable.type == "Boolean":
        return 0, 1
    low = -1e9 if variable.minimum is None else variable.minimum
    high = 1e9 if variable.maximum is None else variable.maximum
    if variable.type.startswith("U"):
        low = max(low, 0)
    return low, min(high, _MOST.get(variable.name, high))


def valid(rng: np.random.Generator, variable: Variable, count: int = 1) -> Array:
    """Values within the bounds: the start, the bounds themselves, or any, small ones often.

    Returns:
        float64, shape (count,).
    """
    low, high = bounds(variable)
    width = high - low
    choices = [
        np.full(count, min(max(variable.start, low), high)),
        np.full(count, low),
        np.full(count, high),
        rng.uniform(low, high, count),
        low + width * 10 ** rng.uniform(-9, 0, count),
    ]
    value = np.array(choices[rng.choice(5, p=(0.15, 0.15, 0.1, 0.35, 0.25))], np.float64)
    return np.clip(np.round(value), low, high) if variable.type in _WHOLE else value


def hostile(rng: np.random.Generator, variable: Variable, count: int = 1) -> Array:
    """Values of which some are out of bounds or no numbers, float64, shape (count,)."""
    value = valid(rng, variable, count)
    if count > 0:
        value[rng.integers(0, count)] = rng.choice(HOSTILE)
    return value


def coordinates(rng: np.random.Generator, count: int, columns: int, farthest: float) -> Array:
    """Places [m]: near to each other, in one place, on a line, or as far as can be.

    Returns:
        float64, shape (count, columns).
    """
    spread = 10 ** rng.uniform(-6, np.log10(farthest))
    centre = rng.uniform(-1, 1, columns) * farthest * rng.choice((0, 0, 0, 0.3, 1.0))
    match rng.integers(0, 6):
        case 0:
            found = np.zeros((count, columns))
        case 1:
            found = np.outer(rng.uniform(-1, 1, count), rng.uniform(-1, 1, columns)) * spread
        case 2:
            found = np.round(rng.uniform(-2, 2, (count, columns))) * spread
        case 3:
            found = rng.choice((-1.0, 1.0), (count, columns)) * farthest
        case _:
            found = rng.uniform(-1, 1, (count, columns)) * min(spread, 300)
    clipped: Array = np.clip(found + centre, -farthest, farthest)
    return clipped
