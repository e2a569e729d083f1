"""A run of the whole stack, event by event: frames go on air when they did in Veins.

Without the draws of the medium access everything but the draws of reception is determined: which
frames arrive, how strongly, which frame a receiver is locked on, and so the classes U (weak), T
(transmitting), B (busy) and "decoded" (R, N or C) of every event. Which of the decoded frames is
received depends on draws. Their number is the sum of independent draws with the probabilities that
the channel states for the SNIR that Veins recorded; the golden count and ours must both lie within
4 standard deviations of that sum.
"""

from collections.abc import Sequence
from typing import Any, Final

import numpy as np

from fmus.messages.records import OUTCOMES
from orchestrator.signal import Array
from studies.verification.channel.comparison import Comparison, Series
from studies.verification.channel.error_rate import success
from studies.verification.channel.progress import Progress
from studies.verification.channel.session import ChannelUnderTest
from studies.verification.channel.stack_matching import Matching, Pairs, match
from studies.verification.channel.stack_replay import StepResult, replay, steps, together
from studies.verification.channel.stack_run import StackRun
from studies.verification.channel.stack_spanning import is_uncertain, late_powers
from studies.verification.channel.tolerances import COUNT, STACK_POWER, STACK_SNIR, Tolerance

_RECEIVED: Final = OUTCOMES.index("R")
_DECODED: Final = "RNC"
_SHOWN: Final = 5


def span(run: StackRun) -> int:
    """Units of progress."""
    return steps(run)


def compare(
    channel: ChannelUnderTest, run: StackRun, progress: Progress
) -> tuple[Comparison, Pairs]:
    """Replay the run; the comparison, and all events."""
    results: list[StepResult] = []
    given = {"medium_access": False, "weak_receptions": True}
    for result in replay(channel, run, given, run.frames.start):
        results.append(result)
        progress.advance()
    result = together(results)
    matching = match(run, result.receptions)
    pairs = matching.pairs
    power, power_notes, largest = _powers(channel, run, pairs)
    snir, snir_notes, details = _snir(run, pairs)
    wrong_counts, counts = _received(channel, run, pairs)
    mismatches = _mismatches(run, matching, result)
    return Comparison(
        cases=len(pairs.frame) + len(matching.missing),
        largest=largest,
        unit=STACK_POWER.unit,
        tolerance=STACK_POWER.limit,
        mismatches=len(mismatches),
        misses=len(power_notes) + len(snir_notes) + len(wrong_counts),
        excepted=matching.unlisted,
        notes=(*mismatches[:_SHOWN], *power_notes[:_SHOWN], *snir_notes[:_SHOWN], *wrong_counts),
        details={**details, **counts, "outcomes": _outcomes(pairs)},
        series=(power, snir),
    ), pairs


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


def _powers(
    channel: ChannelUnderTest, run: StackRun, pairs: Pairs
) -> tuple[Series, list[str], float]:
    """Received powers, those that are too far apart, and the largest error."""
    ours = late_powers(channel, run, pairs)
    series = Series(label="received power", golden=pairs.power[:, 0], ours=ours)
    rows = np.arange(len(ours))
    notes = _far_apart(run, pairs, series, rows, STACK_POWER)
    return series, notes, float(np.abs(series.golden - series.ours).max(initial=0.0))


def _snir(run: StackRun, pairs: Pairs) -> tuple[Series, list[str], dict[str, Any]]:
    """Lowest SNIR of events that both sides decoded, and those that are too far apart."""
    decoded = np.isfinite(pairs.snir).all(axis=1)
    uncertain = decoded & is_uncertain(run, pairs)
    rows = np.flatnonzero(decoded & ~uncertain)
    series = Series(label="lowest SNIR", golden=pairs.snir[rows, 0], ours=pairs.snir[rows, 1])
    details = {
        "max_snir_error": float(np.abs(series.golden - series.ours).max(initial=0.0)),
        "snir_excepted": int(uncertain.sum()),
    }
    return series, _far_apart(run, pairs, series, rows, STACK_SNIR), details


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


def _outcomes(pairs: Pairs) -> dict[str, dict[str, int]]:
    return {
        who: {letter: int((outcome == k).sum()) for k, letter in enumerate(OUTCOMES)}
        for who, outcome in (("golden", pairs.golden), ("ours", pairs.ours))
    }


def _received(
    channel: ChannelUnderTest, run: StackRun, pairs: Pairs
) -> tuple[Sequence[str], dict[str, Any]]:
    """Counts of received frames that are too far from the sum of their probabilities."""
    snir, times = np.unique(pairs.snir[np.isfinite(pairs.snir[:, 0]), 0], return_counts=True)
    probability = np.empty(0)
    if len(snir):
        size = np.full(len(snir), run.parameters.size)
        header, payload = success(channel, snir, size, run.parameters.channel["bitrate"])
        probability = header * payload
    predicted = float((times * probability).sum())
    sigma = float(np.sqrt((times * probability * (1 - probability)).sum()))
    counts = {
        who: int((outcome == _RECEIVED).sum())
        for who, outcome in (("golden", pairs.golden), ("ours", pairs.ours))
    }
    # the count of fewer than one frame at stake is not normal: one frame is always allowed for
    limit = COUNT.limit * max(sigma, 1.0)
    wrong = [
        f"{run.name}: {count} frames received ({who}), {predicted:.1f} +- {sigma:.1f} predicted"
        for who, count in counts.items()
        if abs(count - predicted) > limit
    ]
    received = {**counts, "predicted": round(predicted, 3), "sigma": round(sigma, 3)}
    return wrong, {"received": received}
