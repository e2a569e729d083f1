"""Inputs that are made of outputs: elements, arithmetic, sums, delays, sample and hold."""

from collections import defaultdict, deque
from collections.abc import Iterable, Mapping, Sequence
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
            for term in (t for mix in mixes for t in mix.terms):
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

    def memory(self) -> dict[str, Any]:
        """The past, as `orchestrator.packing` takes it."""
        return {
            "now": self.now,
            "past": [[list(entry) for entry in each.entries] for each in self._histories.values()],
        }

    def recall(self, memory: Mapping[str, Any]) -> None:
        """Know what `memory` told, in place of all else."""
        self.now = memory["now"]
        for each, entries in zip(self._histories.values(), memory["past"], strict=True):
            each.entries.clear()
            each.entries.extend((when, value) for when, value in entries)

    def histories_of(self, component: str) -> "tuple[PastValues, ...]":
        """Those of the outputs of one component."""
        return tuple(h for (name, _), h in self._histories.items() if name == component)

    def history(self, component: str, output: str) -> "PastValues | None":
        """That of one output, if somebody asks for its past."""
        return self._histories.get((component, output))

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

    Attributes:
        output: the name.
        entries: what it showed, and from when on [ns], oldest first.
        span: how far back [ns].
    """

    __slots__ = ("_published", "_sources", "entries", "output", "span")

    def __init__(
        self, sources: MixSources, published: Signals, output: str, span: StepSize
    ) -> None:
        self._sources = sources
        self._published = published
        self.output: Final = output
        self.span: Final = span
        self.entries: Final[deque[tuple[Time, Signal]]] = deque()

    def note(self) -> None:
        """Remember what has just been published; a step that is repeated replaces the value."""
        now, entries = self._sources.now, self.entries
        if entries and entries[-1][0] == now:
            entries.pop()
        self.extend([(now, self._published[self.output])])

    def extend(self, later: Iterable[tuple[Time, Signal]]) -> None:
        """Add entries behind the last one, and forget what is too old then."""
        entries = self.entries
        entries.extend(later)
        while len(entries) > 1 and entries[1][0] <= entries[-1][0] - self.span:
            entries.popleft()

    def at(self, t: Time) -> Signal | None:
        """The last value up to `t` [ns]; `None` before the first one."""
        for when, value in reversed(self.entries):
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
        mix: how.
        start: its start value.
    """

    __slots__ = ("_held", "_parts", "_value", "input", "mix", "start")

    def __init__(self, mix: Mix, start: Signal, sources: MixSources) -> None:
        self.input: Final = mix.input
        self.mix: Final = mix
        self.start: Final = start
        self._parts = [
            (part, [Reading(term, sources) for term in part.terms]) for part in mix.parts
        ]
        self._held: list[Signal | None] = []
        self._value: Signal = start

    @property
    def readings(self) -> "list[Reading]":
        """What its terms see, part by part."""
        return [reading for _, readings in self._parts for reading in readings]

    def value(self) -> Signal:
        """The value now; the same object as before if no source has another one.

        Raises:
            MixError: it is not finite, or values of different lengths are to be added.
        """
        found = [reading.value() for reading in self.readings]
        if len(found) != len(self._held) or any(
            a is not b for a, b in zip(found, self._held, strict=True)
        ):
            self._value = self._made(found)
            self._held = found
        return self._value

    def _made(self, found: Sequence[Signal | None]) -> Signal:
        dtype = self.mix.dtype
        if dtype is None:
            return self.start if found[0] is None else found[0]
        working = np.dtype(np.float64) if dtype.kind == "f" else dtype
        made: Array = np.asarray(self.start).astype(working)
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
            raise not_finite(self.input)
        result.flags.writeable = False
        return result


class MixError(CosimError):
    """Values that arrive at an input cannot be put together. Exit code 3."""


def not_finite(input_: str) -> MixError:
    """The error for a value of an input that is infinite or NaN."""
    return MixError(f"what its connections make of input `{input_}` is not finite")


class Reading:
    """What one term sees of its output.

    A sampled value is read at multiples of the sample time; steps that are repeated there read
    it again.

    Attributes:
        term: the output, and what becomes of it.
        held: the value that was sampled last, if there is one.
        held_from: when [ns].
    """

    __slots__ = ("_sources", "held", "held_from", "term")

    def __init__(self, term: Term, sources: MixSources) -> None:
        self.term: Final = term
        self._sources = sources
        self.held: Signal | None = None
        self.held_from: Time | None = None

    def value(self) -> Signal | None:
        """The value now; `None` before there is one."""
        term, sources = self.term, self._sources
        if not term.sample:
            return self._delayed(sources.now)
        points = CommunicationGrid(sources.beginning, term.sample, 0)
        due = points.at(points.last(sources.now))
        if self.held is None or due != self.held_from or due == sources.now:
            self.held, self.held_from = self._delayed(due), due
        return self.held

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
