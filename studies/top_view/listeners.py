"""Whose receptions are on the page: those whom a run is about, for there is no room for all."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np

from orchestrator.page.layer import PageOfRun
from orchestrator.signal import Array
from studies.top_view.crowd import Crowd

MOST_FULL: Final = 3
MOST_PARTLY: Final = 16


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Listeners:
    """Vehicles, as places in the crowd.

    Attributes:
        full: all that they hear is on the page, int64, shape (listener,).
        partly: beside these, what is not broadcast all the time, and what they hear of each
            other, shape (listener,).
    """

    full: Array
    partly: Array

    def wants(self, receiver: Array, transmitter: Array, is_rare: Array) -> Array:
        """Which receptions are wanted.

        Args:
            receiver: places in the crowd, shape (n,).
            transmitter: likewise.
            is_rare: whether each is of something else than a BSM, shape (n,).

        Returns:
            Truths, shape (n,).
        """
        known = np.concatenate([self.full, self.partly])
        listens = np.isin(receiver, self.partly)
        return np.isin(receiver, self.full) | (listens & (is_rare | np.isin(transmitter, known)))


def listeners_of(run: PageOfRun, crowd: Crowd, egos: Mapping[str, str], used: Array) -> Listeners:
    """Choose them: egos, else declared entities, else who is there longest.

    Args:
        run: with the signals of `egos`.
        crowd: everybody.
        egos: names of entities, by the signal of their number.
        used: relays of packets, places in the crowd, the most used first, shape (relay,).
    """
    numbers = [np.asarray(run.recording[name].values).reshape(-1) for name in egos]
    found = crowd.index(np.array([each.max() for each in numbers if len(each)], np.int64))
    chosen = [place for place in found.tolist() if place >= 0 and crowd.radio[place]]
    chosen.sort(key=lambda place: int(crowd.roles[place]))
    declared = np.flatnonzero((crowd.roles > 0) & crowd.radio).tolist()
    if not chosen:
        chosen = declared
    if not chosen:
        owner = crowd.index(crowd.vehicles.ids)
        lasts = np.bincount(owner, minlength=len(crowd.ids)) * crowd.radio
        chosen = [k for k in np.argsort(-lasts, kind="stable").tolist() if crowd.radio[k]]
    full = list(dict.fromkeys(chosen))[:MOST_FULL]
    partly = [k for k in dict.fromkeys([*chosen, *declared, *used.tolist()]) if k not in full]
    is_needed = bool(declared or len(used))
    return Listeners(
        full=np.array(full, np.int64),
        partly=np.array(partly[:MOST_PARTLY] if is_needed else [], np.int64),
    )
