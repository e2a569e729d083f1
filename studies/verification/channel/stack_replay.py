"""A recorded run with our channel: replayed, and our events beside the golden ones."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from fmus.messages.records import LINKS, NO_VEHICLE, OUTCOMES, PACKET, RECEPTION, TRANSMISSION
from orchestrator.signal import Array
from studies.verification.channel.comparison import ReceptionRatio
from studies.verification.channel.session import ChannelUnderTest, building_inputs
from studies.verification.channel.stack_run import Frames, StackRun

_LONGEST_FRAME: Final = 20_000_000
"""4095 bytes at 3 Mbit/s take 11 ms; the last one is heard to its end."""
_MARGIN: Final = 1_000
"""Events so near to the ends of the recorded span may be on either side of them [ns]."""
_BIN: Final = 25.0
"""Width of the bins of distance in which receptions are counted [m]."""
_FEWEST: Final = 30
"""Events in a bin that is shown."""


@dataclass(frozen=True, slots=True)
class StepResult:
    """What the channel said in one step.

    Attributes:
        receptions: RECEPTION records, shape (reception,); the id of a packet is its index in
            `Frames`.
        transmissions: TRANSMISSION records, shape (transmission,).
    """

    receptions: Array
    transmissions: Array


def replay(
    channel: ChannelUnderTest, run: StackRun, parameters: Mapping[str, Any], times: Array
) -> Iterator[StepResult]:
    """Step from update to update, each step with the positions of its beginning.

    After the last update comes one more step without packets, in which the last frames end.

    Args:
        channel: makes the instance that is stepped.
        run: the recorded run.
        parameters: of the instance, beside those of the run.
        times: when the packet of each frame is handed over [ns], shape (frame,).
    """
    updates, h = run.updates, run.parameters.interval
    order = np.argsort(times, kind="stable")
    packets = _packets(run, times)[order]
    cuts = np.searchsorted(packets["time"], [update.time for update in updates[1:]])
    handed = np.split(packets, cuts)
    first = {**updates[0].vehicles, **building_inputs(run.rings)}
    values = {**run.parameters.channel, **parameters}
    with channel.start(values, first, at=updates[0].time) as session:
        for update, records in zip(updates, handed, strict=True):
            received = session.send(records, update.vehicles, h=h)
            yield StepResult(received, session.transmissions())
        received = session.send(packets[:0], h=-(-_LONGEST_FRAME // h) * h)
        yield StepResult(received, session.transmissions())


def steps(run: StackRun) -> int:
    """Count the results that `replay` yields."""
    return len(run.updates) + 1


def _packets(run: StackRun, times: Array) -> Array:
    frames: Frames = run.frames
    packets = np.zeros(len(times), PACKET)
    packets["id"] = np.arange(len(times))
    packets["time"] = times
    packets["source"] = frames.vehicle
    packets["destination"], packets["route"] = NO_VEHICLE, NO_VEHICLE
    packets["size"] = run.parameters.size
    packets["access_category"] = run.parameters.access_category
    return packets


def together(results: Sequence[StepResult]) -> StepResult:
    """Join the results of all steps."""
    return StepResult(
        np.concatenate([np.empty(0, RECEPTION), *(one.receptions for one in results)]),
        np.concatenate([np.empty(0, TRANSMISSION), *(one.transmissions for one in results)]),
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class Pairs:
    """Golden events and ours.

    Attributes:
        frame: index in `Frames`, shape (event,).
        receiver: a vehicle, shape (event,).
        golden, ours: index in `OUTCOMES`, shape (event,) each.
        link: index in `LINKS`, as the channel has it, shape (event,).
        distance: between the antennas, in the plane [m], shape (event,).
        power: received power [dBm], golden and ours, shape (event, 2).
        snir: lowest SNIR [dB], golden and ours, shape (event, 2).
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
        missing: indices of golden events without one of ours, shape (missing,).
        extra: RECEPTION records without a golden event, shape (extra,).
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
    """Pair the golden events with ours.

    Args:
        run: has the golden events.
        received: RECEPTION records, shape (reception,), whose packets are indices in `Frames`.
    """
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


def ratio_over_distance(pairs: Pairs) -> tuple[ReceptionRatio, ...]:
    """Count receptions over the distance, for every class of links that occurs."""
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
