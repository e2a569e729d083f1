"""A run of the whole stack, event by event: frames go on air when they did in Veins.

Without the draws of the medium access everything but the draws of reception is determined: which
frames arrive, how strongly, which frame a receiver is locked on, and so the classes U (weak), T
(transmitting), B (busy) and "decoded" (R, N or C) of every event. Which of the decoded frames is
received depends on draws. Their number is the sum of independent draws with the probabilities that
the channel states for the SNIR that Veins recorded; the golden count and ours must both lie within
4 standard deviations of that sum.

*Frames on air while the positions change.* The channel, as Veins, takes the losses of a frame at
its start. But Veins puts off what it does not need: once path loss and buildings have brought a
frame below the sensitivity, the vehicles in between are looked at only when somebody asks for the
exact power: another frame that is being decoded, or, at the frame's end, the recorder of these
data. If positions have been updated by then, Veins uses the new positions of the bodies, but the
old ones of the two antennas.

That is no property of a radio channel, and the channel does not copy it. The golden power of such a
frame may be what the channel says of the link at the frame's start, or of a link between the same
antennas among the new bodies, whichever is nearer. The lowest SNIR of frames that are on air during
an update, or overlap one that is, is not compared.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from fmus.messages.records import NO_VEHICLE, OUTCOMES
from orchestrator.signal import Array
from studies.verification.channel.check import Advance
from studies.verification.channel.comparison import SHOWN, Comparison, Received, Series
from studies.verification.channel.reception import success
from studies.verification.channel.session import ChannelUnderTest, building_inputs, link_inputs
from studies.verification.channel.stack_replay import (
    Matching,
    Pairs,
    StepResult,
    match,
    replay,
    together,
)
from studies.verification.channel.stack_run import StackRun
from studies.verification.channel.tolerances import COUNT, STACK_POWER, STACK_SNIR, Tolerance

_RECEIVED: Final = OUTCOMES.index("R")
_DECODED: Final = "RNC"


@dataclass(frozen=True, slots=True, kw_only=True)
class GivenTimes:
    """A run with given transmit times.

    Attributes:
        comparison: of powers, SNIR, classes and counts.
        pairs: all events.
        snir_error: the largest error of the lowest SNIR [dB].
        snir_excepted: decoded frames whose SNIR is not compared.
        received: frames received.
    """

    comparison: Comparison
    pairs: Pairs
    snir_error: float
    snir_excepted: int
    received: Received

    @property
    def outcomes(self) -> Array:
        """How often each outcome occurs in golden and our events, shape (2, outcome)."""
        both = (self.pairs.golden, self.pairs.ours)
        return np.stack([np.bincount(one, minlength=len(OUTCOMES)) for one in both])


def with_given_times(channel: ChannelUnderTest, run: StackRun, advance: Advance) -> GivenTimes:
    """Replay the run with the recorded transmit times, and compare every event.

    Raises:
        ComponentError: the channel failed.
    """
    results: list[StepResult] = []
    given = {"medium_access": False, "weak_receptions": True}
    for result in replay(channel, run, given, run.frames.start):
        results.append(result)
        advance()
    result = together(results)
    matching = match(run, result.receptions)
    pairs = matching.pairs
    power, power_notes = _powers(channel, run, pairs)
    snir, snir_notes, excepted = _snir(run, pairs)
    received = _received(channel, run, pairs)
    wrong_counts = _wrong_counts(run, received)
    mismatches = _mismatches(run, matching, result)
    comparison = Comparison(
        cases=len(pairs.frame) + len(matching.missing),
        largest=_largest_error(power),
        unit=STACK_POWER.unit,
        tolerance=STACK_POWER.limit,
        mismatches=len(mismatches),
        misses=len(power_notes) + len(snir_notes) + len(wrong_counts),
        excepted=matching.unlisted,
        notes=(*mismatches[:SHOWN], *power_notes[:SHOWN], *snir_notes[:SHOWN], *wrong_counts),
        series=(power, snir),
    )
    return GivenTimes(
        comparison=comparison,
        pairs=pairs,
        snir_error=_largest_error(snir),
        snir_excepted=excepted,
        received=received,
    )


def _mismatches(run: StackRun, matching: Matching, result: StepResult) -> list[str]:
    """A sentence for everything that has another class, or another time."""
    totals = run.pair_totals
    return [
        *_wrong_durations(run, result.transmissions),
        *matching.notes(run),
        *_misclassed(run, matching.pairs),
        *(
            totals.differences(run.name, run.names, run.counted(result.receptions))
            if totals
            else ()
        ),
    ]


def _wrong_durations(run: StackRun, sent: Array) -> list[str]:
    """Frames that are not on air as long, or not from the time, that was recorded."""
    frames, number = run.frames, sent["packet"]
    off = (sent["duration"] != frames.duration[number]) | (sent["time"] != frames.start[number])
    return [
        f"{run.name}: frame {frames.sequence[one['packet']]} of {run.names[one['transmitter']]} "
        f"goes on air at {one['time']} ns for {one['duration']} ns, golden at "
        f"{frames.start[one['packet']]} ns for {frames.duration[one['packet']]} ns"
        for one in sent[off]
    ]


def _misclassed(run: StackRun, pairs: Pairs) -> list[str]:
    """Events of another class; those that are decoded are one class."""
    classes = np.array([0 if letter in _DECODED else k for k, letter in enumerate(OUTCOMES)])
    wrong = np.flatnonzero(classes[pairs.golden] != classes[pairs.ours])
    return [
        f"{_place(run, pairs, k)}: golden {OUTCOMES[pairs.golden[k]]} at {pairs.power[k, 0]:.4f} "
        f"dBm, ours {OUTCOMES[pairs.ours[k]]} at {pairs.power[k, 1]:.4f} dBm"
        for k in map(int, wrong)
    ]


def _place(run: StackRun, pairs: Pairs, k: int) -> str:
    return run.place(int(pairs.frame[k]), int(pairs.receiver[k]))


def _powers(channel: ChannelUnderTest, run: StackRun, pairs: Pairs) -> tuple[Series, Sequence[str]]:
    """Received powers, and those that are too far apart."""
    ours = late_powers(channel, run, pairs)
    series = Series(label="received power", golden=pairs.power[:, 0], ours=ours)
    return series, _far_apart(run, pairs, series, np.arange(len(ours)), STACK_POWER)


def _largest_error(series: Series) -> float:
    return float(np.abs(series.golden - series.ours).max(initial=0.0))


def _snir(run: StackRun, pairs: Pairs) -> tuple[Series, Sequence[str], int]:
    """Lowest SNIR of events that both sides decoded, those too far apart, how many are excepted."""
    decoded = np.isfinite(pairs.snir).all(axis=1)
    uncertain = decoded & is_uncertain(run, pairs)
    rows = np.flatnonzero(decoded & ~uncertain)
    series = Series(label="lowest SNIR", golden=pairs.snir[rows, 0], ours=pairs.snir[rows, 1])
    return series, _far_apart(run, pairs, series, rows, STACK_SNIR), int(uncertain.sum())


def _far_apart(
    run: StackRun, pairs: Pairs, series: Series, rows: Array, tolerance: Tolerance
) -> list[str]:
    """A sentence for each value outside the tolerance, the farthest first."""
    error = np.abs(series.golden - series.ours)
    bad = np.flatnonzero(~(error <= tolerance.limit))
    return [
        f"{_place(run, pairs, rows[k])}: {series.label}: golden {series.golden[k]:.4f}, ours "
        f"{series.ours[k]:.4f}"
        for k in bad[np.argsort(-error[bad])]
    ]


def _received(channel: ChannelUnderTest, run: StackRun, pairs: Pairs) -> Received:
    """Frames that were received, beside the sum of their probabilities."""
    snir, times = np.unique(pairs.snir[np.isfinite(pairs.snir[:, 0]), 0], return_counts=True)
    probability = np.empty(0)
    if len(snir):
        size = np.full(len(snir), run.parameters.size)
        header, payload = success(channel, snir, size, run.parameters.channel["bitrate"])
        probability = header * payload
    return Received(
        golden=int((pairs.golden == _RECEIVED).sum()),
        ours=int((pairs.ours == _RECEIVED).sum()),
        predicted=float((times * probability).sum()),
        sigma=float(np.sqrt((times * probability * (1 - probability)).sum())),
    )


def _wrong_counts(run: StackRun, received: Received) -> list[str]:
    """A sentence for each count that is too far from the sum of the probabilities."""
    predicted, sigma = received.predicted, received.sigma
    # the count of fewer than one frame at stake is not normal: one frame is always allowed for
    limit = COUNT.limit * max(sigma, 1.0)
    return [
        f"{run.name}: {count} frames received ({who}), {predicted:.1f} +- {sigma:.1f} predicted"
        for who, count in (("golden", received.golden), ("ours", received.ours))
        if abs(count - predicted) > limit
    ]


def spanning(run: StackRun) -> Array:
    """Find frames that end after an update that follows their start: indices, shape (n,)."""
    frames = run.frames
    last = run.updates_at(frames.start + frames.duration)
    return np.flatnonzero(last != run.updates_at(frames.start))


def late_powers(channel: ChannelUnderTest, run: StackRun, pairs: Pairs) -> Array:
    """Our received powers as Veins records them: `pairs.power`, but for frames on air at updates.

    Returns:
        Powers [dBm], shape (event,).
    """
    power: Array = pairs.power[:, 1].copy()
    if not run.parameters.channel["vehicle_shadowing"]:
        return power
    for frame in spanning(run):
        rows = np.flatnonzero(pairs.frame == frame)
        if len(rows):
            early, late = _early_and_late(channel, run, int(frame), pairs.receiver[rows])
            is_weak = early < run.parameters.channel["sensitivity"]
            golden, ours = pairs.power[rows].T
            is_nearer = np.abs(late - golden) < np.abs(ours - golden)
            power[rows] = np.where(is_weak & is_nearer, late, ours)
    return power


def _early_and_late(
    channel: ChannelUnderTest, run: StackRun, frame: int, receivers: Array
) -> tuple[Array, Array]:
    """Powers without vehicles in between, and among those of the next update [dBm].

    Both have the shape (receiver,).
    """
    update = int(run.updates_at(run.frames.start[[frame]])[0])
    bodies = run.updates[update + 1].vehicles
    antennas = run.antennas(np.full(len(receivers), update), receivers)
    carriers = np.stack([np.full(len(receivers), run.frames.vehicle[frame]), receivers], axis=-1)
    carriers[~np.isin(carriers, bodies["vehicle.id"])] = NO_VEHICLE  # it has left
    transmitters = np.broadcast_to(run.frames.antenna[frame], antennas.shape)
    probes = link_inputs(transmitters, antennas, carriers)
    inputs = {**bodies, **building_inputs(run.rings), **probes}
    with channel.start(run.parameters.channel, inputs) as session:
        early = run.parameters.channel["transmit_power"] - session.probed("path_loss")
        if run.parameters.channel["building_shadowing"]:
            early = early - session.probed("building_loss")
        return early, early - session.probed("vehicle_loss")


def is_uncertain(run: StackRun, pairs: Pairs) -> Array:
    """Find events whose interferers Veins may have weighed late: bool, shape (event,)."""
    frames = run.frames
    start, end = frames.start, frames.start + frames.duration
    uncertain = np.zeros(len(start), np.bool_)
    for frame in spanning(run):
        uncertain |= (start <= end[frame]) & (end >= start[frame])
    found: Array = uncertain[pairs.frame]
    return found
