"""How the cost grows with the number of vehicles."""

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Final

import numpy as np

from benchmarks.benchmark import Measurement, Row
from benchmarks.spread import Spread

TARGET: Final = 1.3
"""Cost shall grow slower than with this power of the number of vehicles."""

_UNIT: Final = "exponent of N"


def fitted(cost: Mapping[int, float]) -> float:
    """The exponent p of cost = c N^p, by least squares of the logarithms.

    Args:
        cost: positive, by number of vehicles; at least two numbers.
    """
    slope, _ = np.polyfit(np.log(list(cost)), np.log(list(cost.values())), deg=1)
    return float(slope)


def between_ends(cost: Mapping[int, float]) -> float:
    """The exponent that the smallest and the largest number of vehicles alone show."""
    low, high = min(cost), max(cost)
    return math.log(cost[high] / cost[low]) / math.log(high / low)


def exponent_rows(case: str, runs: Mapping[int, Sequence[Measurement]]) -> Iterator[Row]:
    """Exponents of the CPU time of all steps, and of the same per vehicle.

    The set-up is left out: being the same for all, it would make the growth look slower.

    Args:
        case: the first part of the names of the rows.
        runs: the repetitions by number of vehicles, over the same simulated time.
    """
    complete = min(map(len, runs.values()))
    costs = [
        {n: each[k]["total_s"] - each[k]["setup_s"] for n, each in runs.items()}
        for k in range(complete)
    ]
    for name, exponent in (("fit", fitted), ("ends", between_ends)):
        found = Spread.of(map(exponent, costs))
        for what, less in (("total", 0.0), ("per vehicle", 1.0)):
            yield Row(
                case=f"{case}/{what}/{name}",
                ours=found.median - less,
                low=found.low - less,
                high=found.high - less,
                unit=_UNIT,
                peer=TARGET,
                peer_name="target",
                is_higher_better=False,
            )
