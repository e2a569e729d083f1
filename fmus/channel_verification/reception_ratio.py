"""Packet reception ratio over the distance, by what obstructs the link."""

from typing import Final

import numpy as np

from fmus.channel_verification.comparison import ReceptionRatio
from fmus.channel_verification.stack_matching import Pairs
from fmus.records import LINKS, OUTCOMES
from orchestrator.signal import Array

_BIN: Final = 25.0
_FEWEST: Final = 30
"""Events in a bin that is shown."""
_Z: Final = 1.959963984540054
"""Of a two-sided interval of 95 %."""


def ratio_over_distance(pairs: Pairs) -> tuple[ReceptionRatio, ...]:
    """The ratios of every class that occurs."""
    which = (pairs.distance // _BIN).astype(np.int64)
    bins = int(which.max(initial=-1)) + 1
    received = OUTCOMES.index("R")
    found = []
    for k, name in enumerate(LINKS):
        own = pairs.link == k
        events, golden, ours = (
            np.bincount(which[own & chosen], minlength=bins)
            for chosen in (True, pairs.golden == received, pairs.ours == received)
        )
        shown = events >= _FEWEST
        if shown.any():
            middle = (np.flatnonzero(shown) + 0.5) * _BIN
            found.append(
                ReceptionRatio(
                    link=name,
                    distance=middle,
                    events=events[shown],
                    golden=golden[shown],
                    ours=ours[shown],
                )
            )
    return tuple(found)


def wilson(successes: Array, trials: Array) -> tuple[Array, Array]:
    """Bounds of the Wilson score interval of 95 % of a proportion, shape (n,) each.

    Wilson, JASA 22(158), 1927; for independent trials.
    """
    share = successes / trials
    scale = 1 + _Z**2 / trials
    middle = (share + _Z**2 / (2 * trials)) / scale
    half = _Z / scale * np.sqrt(share * (1 - share) / trials + _Z**2 / (4 * trials**2))
    return middle - half, middle + half
