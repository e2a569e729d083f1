"""Repeating what participants compute until their outputs agree."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final, TypeAlias

import numpy as np

from orchestrator.algorithm.acceleration import Acceleration
from orchestrator.algorithm.history import real
from orchestrator.algorithm.participant import Participant
from orchestrator.signal import Array, Signal
from orchestrator.timebase import Time

Published: TypeAlias = list[dict[str, Signal]]
"""The outputs of each participant, as others saw them at one moment."""

_AGREED: Final = 1.0
"""The largest change within the tolerance."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Tolerance:
    """Which changes of outputs do not matter.

    Attributes:
        relative: accepted change relative to the value.
        absolute: accepted change in addition, in the unit of the output.
    """

    relative: float
    absolute: float

    def change(self, old: Signal, new: Signal) -> float:
        """How far `new` is from `old`, in tolerances; 0 or infinite for what is no float."""
        if not (_is_real(old) and _is_real(new)) or np.shape(old) != np.shape(new):
            return 0.0 if _is_equal(old, new) else math.inf
        a, b = np.asarray(old), np.asarray(new)
        with np.errstate(divide="ignore", invalid="ignore"):
            ratio = np.abs(b - a) / self.allowed(b)
        return float(np.max(np.where(a == b, 0.0, ratio), initial=0.0))

    def allowed(self, value: Array) -> Array:
        """The accepted change of each element of `value`, of its shape."""
        return np.asarray(self.absolute + self.relative * np.abs(value))


@dataclass(frozen=True, slots=True)
class Disagreement:
    """What still changes most.

    Attributes:
        change: in tolerances.
        participant: whose it is.
        output: its name.
    """

    change: float
    participant: Participant
    output: str


def predict(participant: Participant, t: Time, degree: int) -> None:
    """Let others see for `t` what the last publications make probable, until `publish`.

    Args:
        participant: whose outputs.
        t: where the step ends that begins next [ns].
        degree: of the polynomials through these publications.
    """
    if (history := participant.history) is None:
        return
    history.forget_from(t)
    h = t - participant.before(t)
    shown = {
        output: real(history.course(output, t, h, degree).at(0.0), participant.published[output])
        for output in participant.continuous
        if output in participant.published
    }
    participant.show(shown, t)


def repeat(
    participants: Sequence[Participant],
    sweep: Callable[[], None],
    again: Callable[[], None],
    *,
    tolerance: Tolerance,
    maximum: int,
    acceleration: Acceleration,
) -> Disagreement | None:
    """Repeat `sweep` until no output of the participants changes by more than the tolerance.

    Args:
        participants: those that read each other.
        sweep: lets each compute its outputs from what is published, and publish them.
        again: takes them back before another sweep.
        tolerance: of changes.
        maximum: sweeps at most, at least 2.
        acceleration: new for this solution.

    Returns:
        What does not agree after `maximum` sweeps; `None` if all do.
    """
    worst = None
    before = _published(participants)
    for count in range(1, maximum + 1):
        sweep()
        after = _published(participants)
        worst = _largest_change(participants, before, after, tolerance)
        if worst is None or worst.change <= _AGREED:
            return None
        if count < maximum:
            _accelerate(participants, before, after, acceleration)
            before = _published(participants)
            again()
    return worst


def _published(participants: Sequence[Participant]) -> Published:
    return [dict(each.published) for each in participants]


def _largest_change(
    participants: Sequence[Participant], before: Published, after: Published, tolerance: Tolerance
) -> Disagreement | None:
    changes = (
        Disagreement(
            tolerance.change(old[output], value) if output in old else math.inf, each, output
        )
        for each, old, new in zip(participants, before, after, strict=True)
        for output, value in new.items()
        if value is not old.get(output)
    )
    return max(changes, key=lambda found: found.change, default=None)


def _accelerate(
    participants: Sequence[Participant],
    before: Published,
    after: Published,
    acceleration: Acceleration,
) -> None:
    """Let others see what promises to be nearer to the solution than `after`."""
    read = frozenset().union(*(each.reads for each in participants))
    places = [
        (each, output, old[output], value)
        for each, old, new in zip(participants, before, after, strict=True)
        for output, value in new.items()
        if (each.name, output) in read
        and _is_real(value)
        and output in old
        and np.shape(old[output]) == np.shape(value)
    ]
    if not places:
        return
    seen = np.concatenate([np.ravel(np.asarray(old)) for _, _, old, _ in places], dtype=np.float64)
    computed = np.concatenate([np.ravel(np.asarray(v)) for *_, v in places], dtype=np.float64)
    following = acceleration.following(seen, computed, np.asarray(1.0 + np.abs(computed)))
    if following is computed or not np.isfinite(following).all():
        return
    for each in participants:
        each.show(
            {
                output: real(part.reshape(np.shape(value)), value)
                for (whose, output, _, value), part in zip(
                    places, _parts(following, [np.size(v) for *_, v in places]), strict=True
                )
                if whose is each
            }
        )


def _parts(vector: Array, sizes: Sequence[int]) -> list[Array]:
    return list(np.split(vector, np.cumsum(sizes)[:-1]))


def _is_real(value: Signal) -> bool:
    return isinstance(value, np.ndarray) and value.dtype.kind == "f"


def _is_equal(old: Signal, new: Signal) -> bool:
    if isinstance(old, bytes) or isinstance(new, bytes):
        return old == new
    return np.array_equal(old, new)
