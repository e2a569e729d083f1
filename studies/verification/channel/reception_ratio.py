"""Packet reception ratio over the distance, by what obstructs the link."""

from typing import Final

import numpy as np

from fmus.messages.records import LINKS, OUTCOMES
from studies.verification.channel.comparison import ReceptionRatio
from studies.verification.channel.stack_matching import Pairs

_BIN: Final = 25.0
_FEWEST: Final = 30
"""Events in a bin that is shown."""


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
