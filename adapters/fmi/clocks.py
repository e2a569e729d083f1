"""Clocks of an FMI 3.0 FMU: when they tick, and what they let pass (FMI 3.0.2, section 2.2.8)."""

import enum
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from ctypes import c_bool, c_double, c_int, c_size_t, c_uint32, c_uint64, c_void_p
from dataclasses import dataclass
from fractions import Fraction
from typing import Any, Final, TypeAlias

import numpy as np

from adapters.fmi.errors import FmuError
from adapters.fmi.handle import Handle
from adapters.fmi.variable import Clock, ClockKind, FmuVariable
from orchestrator.signal import Signal, Signals

Read: TypeAlias = Callable[[Sequence[FmuVariable]], dict[str, Signal]]
"""Gets variables, by the names of their elements."""

Write: TypeAlias = Callable[[Mapping[str, Signal]], None]
"""Sets variables, by the names of their elements."""

HALF_NANOSECOND: Final = 0.5e-9
"""Times that are closer than this are one [s]."""

_REFERENCES: Final = (c_void_p, c_void_p, c_size_t)


class Interval(enum.IntEnum):
    """What an FMU says about an interval (`fmi3IntervalQualifier`)."""

    NOT_YET_KNOWN = 0
    UNCHANGED = 1
    CHANGED = 2


@dataclass(slots=True)
class Ticking:
    """When a time-based clock ticks.

    Attributes:
        next_time: the next tick [s], exactly; `None`: not known.
        interval: between periodic ticks [s], exactly; `None`: it is no such clock.
    """

    next_time: Fraction | None = None
    interval: Fraction | None = None


@dataclass(frozen=True, slots=True)
class Memory:
    """What a stored state of the FMU has to bring back here."""

    ticking: Mapping[int, tuple[Fraction | None, Fraction | None]]
    held: Signals
    ticked: frozenset[str]


class Clocks:
    """The clocks of one instance, and the values of clocked variables between ticks.

    Args:
        variables: of the FMU.
        handle: of the instance.
        read: gets clocked outputs while a clock of theirs is active.
        write: sets clocked inputs, likewise.
    """

    def __init__(
        self, variables: Iterable[FmuVariable], handle: Handle, read: Read, write: Write
    ) -> None:
        every = tuple(variables)
        self._handle, self._read, self._write = handle, read, write
        clocks = {v.reference: v.clock for v in every if v.clock is not None}
        self._inputs: dict[int, Clock] = {
            v.reference: v.clock for v in every if v.clock is not None and v.causality == "input"
        }
        self._names = {v.reference: v.name for v in every if v.clock is not None}
        clocked = [v for v in every if v.clocks and v.clock is None]
        self._clocked_outputs = [v for v in clocked if v.causality == "output"]
        # of local ones those that let outputs out
        wanted = {r for v in self._clocked_outputs for r in v.clocks}
        self._shown = [v.reference for v in every if v.clock and v.causality == "output"]
        self._asked = [r for r in clocks if r in self._shown or r in wanted - self._inputs.keys()]
        self._clocked_inputs = [v for v in clocked if v.causality == "input"]
        self._offered: dict[str, Signal] = {}
        self._held: dict[str, Signal] = {}
        self._ticked: frozenset[str] = frozenset()
        self._ticking = {
            r: Ticking() for r, c in self._inputs.items() if c.kind is not ClockKind.TRIGGERED
        }

    @property
    def next_time(self) -> float:
        """The next tick of a time-based clock [s]; infinite if none is known."""
        times = [t.next_time for t in self._ticking.values() if t.next_time is not None]
        return float(min(times)) if times else math.inf

    def start(self, t: float) -> None:
        """Find out when clocks tick first; in initialisation mode, which is at `t` [s]."""
        begin = Fraction(t)
        for reference, ticking in self._ticking.items():
            clock = self._inputs[reference]
            if clock.kind is ClockKind.PERIODIC:
                ticking.interval, shift = clock.interval, clock.shift
                if ticking.interval is None:
                    _, ticking.interval = self._interval(reference, clock)
                    shift = self._shift(reference, clock)
                if ticking.interval <= 0:
                    raise FmuError(
                        f"the clock `{self._names[reference]}` has the interval "
                        f"{float(ticking.interval):.9g} s"
                    )
                ticking.next_time = begin + shift
            else:
                self._ask(reference, begin)
        everything = self._read(self._clocked_outputs)
        self._held.update(everything)

    def due(self, t: float) -> list[int]:
        """The time-based clocks that tick at `t` [s], or should have; by priority."""
        now = Fraction(t) + Fraction(HALF_NANOSECOND)
        found = [
            r for r, k in self._ticking.items() if k.next_time is not None and k.next_time <= now
        ]
        return sorted(found, key=self._order)

    def triggered(self, names: Iterable[str]) -> list[int]:
        """The value references of input clocks, by priority."""
        wanted = set(names)
        return sorted((r for r in self._inputs if self._names[r] in wanted), key=self._order)

    def _order(self, reference: int) -> tuple[int, int]:
        return (self._inputs[reference].priority, reference)

    def offer(self, values: Mapping[str, Signal]) -> None:
        """Keep values of clocked inputs until a clock of theirs ticks."""
        self._offered.update(values)

    def activate(self, references: Sequence[int]) -> None:
        """Let input clocks tick (`fmi3SetClock`), and set the inputs that they let in."""
        if references:
            active = (c_bool * len(references))(*([True] * len(references)))
            self._call("fmi3SetClock", references, active)
            self.let_in(references)

    def let_in(self, references: Sequence[int]) -> None:
        """Set the clocked inputs of these clocks, which tick; countdowns among them are over."""
        for reference in references:
            if self._inputs[reference].kind is ClockKind.COUNTDOWN:
                self._ticking[reference].next_time = None
        ticking = set(references)
        names = [
            e for v in self._clocked_inputs if ticking.intersection(v.clocks) for e in v.elements
        ]
        values = {n: self._offered[n] for n in names if n in self._offered}
        if values:
            self._write(values)

    def let_out(self, references: Sequence[int]) -> None:
        """Get the clocked outputs of these clocks, which tick."""
        ticking = set(references)
        outputs = [v for v in self._clocked_outputs if ticking.intersection(v.clocks)]
        if outputs:
            self._held.update(self._read(outputs))

    def ticking_outputs(self) -> list[int]:
        """The output clocks and local ones that tick now (`fmi3GetClock`)."""
        if not self._asked:
            return []
        active = (c_bool * len(self._asked))()
        self._call("fmi3GetClock", self._asked, active)
        found = [r for r, is_active in zip(self._asked, active, strict=True) if is_active]
        self._ticked |= {self._names[r] for r in found}
        return found

    def schedule(self, ticked: Sequence[int], t: float) -> None:
        """Find out when clocks that ticked at `t` [s] tick next; not countdowns.

        Args:
            ticked: the time-based and triggered input clocks that ticked.
            t: the current time [s].
        """
        for reference, ticking in self._ticking.items():
            clock = self._inputs[reference]
            has_ticked = reference in ticked
            if clock.kind is ClockKind.PERIODIC:
                if has_ticked and ticking.next_time is not None and ticking.interval is not None:
                    ticking.next_time += ticking.interval
            elif clock.kind is ClockKind.CHANGING and has_ticked:
                # exact: what is due at a time that floats only come near to was due at its own
                since = ticking.next_time
                self._ask(reference, Fraction(t) if since is None else since)

    def ask_countdowns(self, t: float) -> None:
        """Ask countdown clocks whether they begin at `t` [s]."""
        for reference in self._ticking:
            if self._inputs[reference].kind is ClockKind.COUNTDOWN:
                self._ask(reference, Fraction(t))

    def _ask(self, reference: int, since: Fraction) -> None:
        """Ask an aperiodic clock for its next interval."""
        qualifier, interval = self._interval(reference, self._inputs[reference])
        is_countdown = self._inputs[reference].kind is ClockKind.COUNTDOWN
        if qualifier is Interval.CHANGED or (not is_countdown and qualifier is Interval.UNCHANGED):
            if interval < 0:
                raise FmuError(
                    f"the clock `{self._names[reference]}` has the interval {float(interval):.9g} s"
                )
            self._ticking[reference].next_time = since + interval

    def _interval(self, reference: int, clock: Clock) -> tuple[Interval, Fraction]:
        qualifier = (c_int * 1)()
        if clock.is_fraction:
            counter, resolution = (c_uint64 * 1)(), (c_uint64 * 1)()
            self._call("fmi3GetIntervalFraction", [reference], counter, resolution, qualifier)
            value = Fraction(counter[0], resolution[0] or 1)
        else:
            decimal = (c_double * 1)()
            self._call("fmi3GetIntervalDecimal", [reference], decimal, qualifier)
            value = _decimal(decimal[0])
        return Interval(qualifier[0]), value

    def _shift(self, reference: int, clock: Clock) -> Fraction:
        if clock.is_fraction:
            counter, resolution = (c_uint64 * 1)(), (c_uint64 * 1)()
            self._call("fmi3GetShiftFraction", [reference], counter, resolution)
            return Fraction(counter[0], resolution[0] or 1)
        decimal = (c_double * 1)()
        self._call("fmi3GetShiftDecimal", [reference], decimal)
        return _decimal(decimal[0])

    def _call(self, name: str, references: Sequence[int], *arguments: Any) -> None:
        """Call a function of clocks."""
        types = (*_REFERENCES, *(c_void_p for _ in arguments))
        listed = (c_uint32 * len(references))(*references)
        function = self._handle.fmu.function(name, types)
        status = function(self._handle.address, listed, len(references), *arguments)
        self._handle.guard.check(name, status)

    def forget_ticks(self) -> None:
        """Begin a step: no output clock has ticked in it."""
        self._ticked = frozenset()

    def values(self) -> dict[str, Signal]:
        """Clocked outputs as they were when they were let out last, and which clocks ticked."""
        found = dict(self._held)
        for reference in self._shown:
            name = self._names[reference]
            found[name] = _TRUE if name in self._ticked else _FALSE
        return found

    def remember(self) -> Memory:
        """What a stored state has to bring back."""
        ticking = {r: (k.next_time, k.interval) for r, k in self._ticking.items()}
        return Memory(ticking, dict(self._held), self._ticked)

    def recall(self, memory: Memory) -> None:
        """Return to what was remembered."""
        for reference, (next_time, interval) in memory.ticking.items():
            self._ticking[reference] = Ticking(next_time, interval)
        self._held, self._ticked = dict(memory.held), memory.ticked


def _decimal(value: float) -> Fraction:
    """The number that was meant: 0.1 s, not the double next to it."""
    if not math.isfinite(value):
        raise FmuError(f"a clock has the interval {value} s")
    return Fraction(repr(value))


def _truth(value: bool) -> Signal:  # noqa: FBT001
    found = np.array(value)
    found.flags.writeable = False
    return found


_TRUE: Final = _truth(True)  # noqa: FBT003
_FALSE: Final = _truth(False)  # noqa: FBT003
