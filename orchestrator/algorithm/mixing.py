"""Inputs that are made of outputs: elements, arithmetic, sums, delays, sample and hold."""

from collections import defaultdict, deque
from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np

from orchestrator.errors import CosimError
from orchestrator.operation import applied
from orchestrator.signal import Array, Signal, Signals
from orchestrator.system import System
from orchestrator.timebase import CommunicationGrid, StepSize, Time
from orchestrator.transformation import Mix, Term


class MixSources:
    """What mixed inputs see of the outputs of all components.

    Args:
        system: the components and connections.
        published: by component, the outputs that others see; changes in place.

    Attributes:
        now: the communication point that the run has reached [ns].
        beginning: the first one [ns].
    """

    __slots__ = ("_histories", "_published", "beginning", "now")

    def __init__(self, system: System, published: Mapping[str, Signals]) -> None:
        self.now: Time = 0
        self.beginning: Time = 0
        self._published = published
        spans: defaultdict[tuple[str, str], StepSize] = defaultdict(int)
        for mixes in system.mixes.values():
            for term in (t for mix in mixes for part in mix.parts for t in part.terms):
                if term.delay or term.sample:
                    end = (term.component, term.output)
                    spans[end] = max(spans[end], term.delay + term.sample)
        self._histories = {
            (component, output): PastValues(self, published[component], output, span)
            for (component, output), span in spans.items()
        }

    def start(self, start: Time) -> None:
        """Begin a run at `start` [ns]."""
        self.now = self.beginning = start

    def histories_of(self, component: str) -> "tuple[PastValues, ...]":
        """Those of the outputs of one component."""
        return tuple(h for (name, _), h in self._histories.items() if name == component)

    def value(self, component: str, output: str) -> Signal | None:
        """What an output shows now; `None` before it shows anything."""
        return self._published[component].get(output)

    def value_at(self, component: str, output: str, t: Time) -> Signal | None:
        """What an output showed last up to the communication point `t` [ns]."""
        return self._histories[component, output].at(t)


class PastValues:
    """The values of one output, as far back as somebody may ask.

    Args:
        sources: who knows the time.
        published: the outputs of the component; changes in place.
        output: the name.
        span: how far back [ns].
    """

    __slots__ = ("_entries", "_output", "_published", "_sources", "_span")

    def __init__(
        self, sources: MixSources, published: Signals, output: str, span: StepSize
    ) -> None:
        self._sources = sources
        self._published = published
        self._output = output
        self._span = span
        self._entries: deque[tuple[Time, Signal]] = deque()

    def note(self) -> None:
        """Remember what has just been published; a step that is repeated replaces the value."""
        now, entries = self._sources.now, self._entries
        if entries and entries[-1][0] == now:
            entries.pop()
        entries.append((now, self._published[self._output]))
        while len(entries) > 1 and entries[1][0] <= now - self._span:
            entries.popleft()

    def at(self, t: Time) -> Signal | None:
        """The last value up to `t` [ns]; `None` before the first one."""
        for when, value in reversed(self._entries):
            if when <= t:
                return value
        return None


class MixedInput:
    """One input that is made of outputs, at every communication point anew.

    Args:
        mix: how.
        start: its start value.
        sources: the outputs.

    Attributes:
        input: its name.
    """

    __slots__ = ("_held", "_mix", "_parts", "_sources", "_start", "_value", "input")

    def __init__(self, mix: Mix, start: Signal, sources: MixSources) -> None:
        self.input: Final = mix.input
        self._mix = mix
        self._start = start
        self._sources = sources
        self._parts = [
            (part, [_Reading(term, sources) for term in part.terms]) for part in mix.parts
        ]
        self._held: list[Signal | None] = []
        self._value: Signal = start

    def value(self) -> Signal:
        """The value now; the same object as before if no source has another one.

        Raises:
            MixError: it is not finite, or values of different lengths are to be added.
        """
        found = [reading.value() for _, readings in self._parts for reading in readings]
        if len(found) != len(self._held) or any(
            a is not b for a, b in zip(found, self._held, strict=True)
        ):
            self._value = self._made(found)
            self._held = found
        return self._value

    def _made(self, found: Sequence[Signal | None]) -> Signal:
        dtype = self._mix.dtype
        if dtype is None:
            return self._start if found[0] is None else found[0]
        working = np.dtype(np.float64) if dtype.kind == "f" else dtype
        made: Array = np.asarray(self._start).astype(working)
        values = iter(found)
        for part, readings in self._parts:
            terms = [_changed(reading.term, next(values), working) for reading in readings]
            known = [each for each in terms if each is not None]
            if len(known) < len(terms):
                continue
            total = _sum(self.input, known)
            if part.placed.are_all:
                made = total
            else:
                made[part.placed.index()] = total
        with np.errstate(over="ignore"):
            result: Array = np.array(made, dtype=dtype)
        if dtype.kind == "f" and not np.isfinite(result).all():
            raise MixError(f"what its connections make of input `{self.input}` is not finite")
        result.flags.writeable = False
        return result


class MixError(CosimError):
    """Values that arrive at an input cannot be put together. Exit code 3."""


class _Reading:
    """What one term sees of its output.

    A sampled value is read at multiples of the sample time; steps that are repeated there read
    it again.
    """

    __slots__ = ("_held", "_held_from", "_sources", "term")

    def __init__(self, term: Term, sources: MixSources) -> None:
        self.term: Final = term
        self._sources = sources
        self._held: Signal | None = None
        self._held_from: Time | None = None

    def value(self) -> Signal | None:
        term, sources = self.term, self._sources
        if not term.sample:
            return self._delayed(sources.now)
        points = CommunicationGrid(sources.beginning, term.sample, 0)
        due = points.at(points.last(sources.now))
        if self._held is None or due != self._held_from or due == sources.now:
            self._held, self._held_from = self._delayed(due), due
        return self._held

    def _delayed(self, t: Time) -> Signal | None:
        term, sources = self.term, self._sources
        if not (term.delay or term.sample):
            return sources.value(term.component, term.output)
        return sources.value_at(term.component, term.output, t - term.delay)


def _changed(term: Term, value: Signal | None, working: "np.dtype[Any]") -> Array | None:
    """The elements of a term in the type in which is added, after its arithmetic."""
    if value is None:
        return None
    picked: Array = np.asarray(value)[term.picked.index()].astype(working)
    with np.errstate(over="ignore", invalid="ignore"):
        return applied(term.operations, picked)


def _sum(name: str, values: Sequence[Array]) -> Array:
    total = values[0]
    for each in values[1:]:
        if each.shape != total.shape:
            shapes = f"{list(total.shape)} and {list(each.shape)}"
            raise MixError(f"outputs of the shapes {shapes} cannot be added in input `{name}`")
        with np.errstate(over="ignore", invalid="ignore"):
            total = total + each
    return total
