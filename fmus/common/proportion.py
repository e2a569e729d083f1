"""How sure a share that was counted is."""

from typing import Final

import numpy as np

from orchestrator.signal import Array

_Z: Final = 1.959963984540054
"""Of a two-sided interval of 95 %."""


def wilson(successes: Array, trials: Array) -> tuple[Array, Array]:
    """Bounds of the Wilson score interval of 95 % of a proportion, shape (n,) each.

    Wilson, JASA 22(158), 1927; for independent trials.
    """
    share = successes / trials
    scale = 1 + _Z**2 / trials
    middle = (share + _Z**2 / (2 * trials)) / scale
    half = _Z / scale * np.sqrt(share * (1 - share) / trials + _Z**2 / (4 * trials**2))
    return middle - half, middle + half
