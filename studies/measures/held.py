"""Recorded numbers that hold from one communication point to the next, read block by block."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from orchestrator.elements import WHOLE, Elements
from orchestrator.recording.declared import declared_shape
from orchestrator.recording.reader import Recording, Series
from orchestrator.signal import Array
from orchestrator.suggestion import suggestion

BLOCK: Final = 1 << 14
"""Samples that are in memory at once."""


@dataclass(frozen=True, slots=True)
class Held:
    """One number over time.

    Attributes:
        name: of the signal, with the indices of an element.
        unit: of its values.
        series: of the signal.
        elements: a single one of it.
    """

    name: str
    unit: str
    series: Series
    elements: Elements = WHOLE

    @classmethod
    def of(cls, recording: Recording, name: str) -> "Held":
        """The number `component.connector`, or an element of it.

        Raises:
            RecordingError: there is no such signal.
            ValueError: it is no single number.
        """
        signal, elements = element(name, dict.fromkeys(recording.signals, ""))
        series = recording[signal]
        if what := no_number(series.kind, elements):
            raise ValueError(f"`{name}` {what}")
        return cls(name, series.unit, series, elements)

    @property
    def times(self) -> Array:
        """When each value was published [ns], int64, shape (sample,)."""
        return self.series.times

    def between(self, first: int, end: int) -> Array:
        """Values `first` to `end` - 1 as recorded, shape (sample,)."""
        samples = self.series.between(first, end)
        return np.asarray(samples[(slice(None), *self.elements.index())]).reshape(-1)


@dataclass(frozen=True, slots=True)
class Stretch:
    """Values that hold from their times on.

    Attributes:
        times: from when on each holds [ns], int64, shape (value,).
        values: float64, shape (value,).
        durations: how long each holds [s], shape (value,); 0 for the last of all.
    """

    times: Array
    values: Array
    durations: Array


def stretches(held: Held, begin: int | None, end: int | None) -> Iterator[Stretch]:
    """The values of a number between two times, block by block.

    The value that holds at `begin` counts from there on.

    Args:
        held: the number.
        begin: [ns]; `None`: the first communication point.
        end: [ns]; `None`: the last communication point.
    """
    times = held.times
    if not len(times):
        return
    start = int(times[0]) if begin is None else max(begin, int(times[0]))
    stop = int(times[-1]) if end is None else min(end, int(times[-1]))
    if stop < start:
        return
    first = int(np.searchsorted(times, start, side="right")) - 1
    last = int(np.searchsorted(times, stop, side="right"))
    for k in range(first, last, BLOCK):
        until = min(k + BLOCK, last)
        since = np.maximum(times[k:until], start)
        following = times[k + 1 : until + 1] if until < last else np.append(since[1:], stop)
        values = held.between(k, until).astype(np.float64)
        yield Stretch(since, values, (following - since) / 1e9)


def element(name: str, signals: Mapping[str, Any]) -> tuple[str, Elements]:
    """The signal that `name` means, and the elements of it.

    A signal whose own name ends in brackets is meant before an element of another.

    Raises:
        ValueError: there is no such signal, or what is in the brackets says no elements.
    """
    if name in signals:
        return name, WHOLE
    found = Elements.split(name)
    if found is not None and found[0] in signals:
        return found
    raise ValueError(f"`{name}` is not recorded; {suggestion(name, signals)}")


def no_number(kind: str, elements: Elements) -> str | None:
    """Why elements of a signal of a declared type are no single number; `None` if they are one."""
    shape = declared_shape(kind)
    if shape is None:
        return f"is {kind}, which is no number"
    if any(isinstance(length, str) for length in shape):
        return f"is {kind}, whose length may change; none of its elements stays the same one"
    try:
        rest = elements.of(shape)
    except ValueError as error:
        return f"is {kind}: {error}"
    if rest == ():
        return None
    example = f"[{', '.join('0' for _ in shape)}]"
    return f"has {math.prod(map(int, rest))} elements; name one of them, such as `{example}`"
