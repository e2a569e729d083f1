"""Golden events of a run beside ours, by frame and receiver."""

from dataclasses import dataclass
from typing import Final

import numpy as np

from fmus.messages.records import OUTCOMES
from orchestrator.signal import Array
from studies.verification.channel.stack_run import StackRun

_MARGIN: Final = 1_000
"""Events so near to the ends of the recorded span may be on either side of them [ns]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Pairs:
    """Golden events and ours, shape (event,) each.

    Attributes:
        frame: index in `Frames`.
        receiver: a vehicle.
        golden, ours: outcomes.
        link: index in `LINKS`, as the channel has it.
        distance: between the antennas, in the plane [m].
        power, snir: golden and ours, shape (event, 2) [dBm, dB].
    """

    frame: Array
    receiver: Array
    golden: Array
    ours: Array
    link: Array
    distance: Array
    power: Array
    snir: Array


@dataclass(frozen=True, slots=True, kw_only=True)
class Matching:
    """Events that both sides have, and those that one lacks.

    Attributes:
        pairs: those of both.
        missing: indices of golden events without one of ours.
        extra: RECEPTION records without a golden event.
        unlisted: number of golden events of frames that are not listed.
    """

    pairs: Pairs
    missing: Array
    extra: Array
    unlisted: int

    def notes(self, run: StackRun) -> list[str]:
        """A sentence for each event that one side lacks."""
        events = run.events
        return [
            f"{run.place(int(events.frame[k]), int(events.receiver[k]))}: no event of ours, golden "
            f"{OUTCOMES[events.outcome[k]]}"
            for k in self.missing
        ] + [
            f"{run.place(int(one['packet']), int(one['receiver']))}: no golden event, ours "
            f"{OUTCOMES[one['outcome']]}"
            for one in self.extra
        ]


def match(run: StackRun, received: Array) -> Matching:
    """Pair the golden events with RECEPTION records whose packets are indices in `Frames`."""
    events, frames = run.events, run.frames
    radios = len(run.names)
    listed = np.flatnonzero(events.frame >= 0)
    golden_key = events.frame[listed] * radios + events.receiver[listed]
    our_key = received["packet"] * radios + received["receiver"]
    order = np.argsort(our_key, kind="stable")
    place = np.minimum(np.searchsorted(our_key[order], golden_key), max(len(order) - 1, 0))
    both = our_key[order][place] == golden_key if len(order) else np.zeros(len(listed), np.bool_)
    begin = received["time"] - frames.duration[received["packet"]]
    first, last = run.parameters.events
    inside = (begin >= first + _MARGIN) & (begin < last - _MARGIN)
    return Matching(
        pairs=_pairs(run, listed[both], received[order[place[both]]]),
        missing=listed[~both],
        extra=run.counted(received[inside & ~np.isin(our_key, golden_key)]),
        unlisted=len(events.frame) - len(listed),
    )


def _pairs(run: StackRun, event: Array, ours: Array) -> Pairs:
    events = run.events
    frame, receiver = events.frame[event], events.receiver[event]
    away = run.antennas(run.updates_at(run.frames.start[frame]), receiver)
    away = away[:, :2] - run.frames.antenna[frame, :2]
    return Pairs(
        frame=frame,
        receiver=receiver,
        golden=events.outcome[event],
        ours=ours["outcome"].astype(np.int64),
        link=ours["link"].astype(np.int64),
        distance=np.hypot(away[:, 0], away[:, 1]),
        power=np.stack([events.power[event], ours["power_dbm"]], axis=-1),
        snir=np.stack([events.snir[event], ours["snir_db"]], axis=-1),
    )
