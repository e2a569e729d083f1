"""Simulation time as integer nanoseconds.

Sums of integers are exact, so two components that meet at a communication point meet
at the same number; so are sums of fractions, which step sizes such as 1/60 s are. Seconds
(`float`) exist only at the edges: scenarios and FMI calls.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Final, TypeAlias

from orchestrator.exact import quotient

Time: TypeAlias = int
"""A point in simulation time, in nanoseconds."""

Duration: TypeAlias = int
"""A span of simulation time, in nanoseconds."""

StepSize: TypeAlias = int | Fraction
"""The distance of communication points, in nanoseconds; a `Fraction` only where it is not whole.

Communication points `start + k * step_size` are exact; a `Time` is the nanosecond nearest to one.
So steps of 1/60 s last 16,666,667 ns or 16,666,666 ns, and the sixtieth ends at 1 s.
"""

NANOSECONDS_PER_SECOND: Final = 1_000_000_000


def nanoseconds(seconds: str | float) -> Time:
    """Convert seconds, as written in a scenario file, to nanoseconds.

    Raises:
        ValueError: `seconds` is not a whole number of nanoseconds.
    """
    exact = quotient(str(seconds)) * NANOSECONDS_PER_SECOND
    if exact.denominator != 1:
        raise ValueError(f"{seconds} s is not a whole number of nanoseconds")
    return int(exact)


def seconds(time: Time) -> float:
    """Convert nanoseconds to the nearest float of seconds, as FMI wants them."""
    return time / NANOSECONDS_PER_SECOND


def as_step_size(exact: Fraction) -> StepSize:
    """A span of nanoseconds, as an `int` where it is whole."""
    return int(exact) if exact.denominator == 1 else exact


def common(first: StepSize, second: StepSize) -> StepSize:
    """The greatest span of which both are multiples: 20 ms of 40 ms and 60 ms."""
    if isinstance(first, int) and isinstance(second, int):
        return math.gcd(first, second)
    denominator = math.lcm(Fraction(first).denominator, Fraction(second).denominator)
    return as_step_size(
        Fraction(math.gcd(int(first * denominator), int(second * denominator)), denominator)
    )


def format_duration(time: StepSize) -> str:
    """`time` in the largest unit that keeps it a whole number, e.g. `50 ms`; or e.g. `1/60 s`."""
    units = (("s", 10**9), ("ms", 10**6), ("us", 10**3))
    if isinstance(time, Fraction):
        return f"{time / NANOSECONDS_PER_SECOND} s"
    for symbol, length in units:
        if time % length == 0:
            return f"{time // length} {symbol}"
    return f"{time} ns"


def _nearest(exact: StepSize) -> Time:
    """The nearest nanosecond; of two, the later one."""
    return exact if isinstance(exact, int) else math.floor(exact + Fraction(1, 2))


@dataclass(frozen=True, slots=True)
class CommunicationGrid:
    """Equidistant communication points `start + k * step_size`, `k = 0, ..., count`.

    Attributes:
        start: the first point [ns].
        step_size: the distance of two points [ns].
        count: the number of steps.
    """

    start: Time
    step_size: StepSize
    count: int

    def __post_init__(self) -> None:
        if self.step_size <= 0:
            raise ValueError(f"the step size must be positive, got {self.step_size} ns")
        if isinstance(self.step_size, Fraction) and self.step_size < 1:
            raise ValueError(f"the step size must be 1 ns at least, got {self.step_size} ns")
        if self.count < 0:
            raise ValueError(f"the number of steps must not be negative, got {self.count}")

    @classmethod
    def over(cls, start: Time, stop: Time, step_size: StepSize) -> "CommunicationGrid":
        """Cover [`start`, `stop`] exactly; refuse a step size that does not fit.

        Raises:
            ValueError: `stop` lies before `start`, `step_size` is not positive, or the interval
                is not a whole number of steps; nothing is rounded.
        """
        if stop < start:
            raise ValueError(f"the interval ends at {stop} ns, before it starts at {start} ns")
        if step_size <= 0:
            raise ValueError(f"the step size must be positive, got {step_size} ns")
        count, rest = divmod(stop - start, step_size)
        if rest:
            raise ValueError(
                f"the interval of {format_duration(stop - start)} is not a whole number of steps "
                f"of {format_duration(step_size)}: {format_duration(rest)} are left over"
            )
        return cls(start, step_size, int(count))

    def __iter__(self) -> Iterator[Time]:
        """Yield the start of each communication step."""
        return (self.at(k) for k in range(self.count))

    def at(self, k: int) -> Time:
        """The point with the number `k`; 0 is the start."""
        return self.start + _nearest(k * self.step_size)

    @property
    def stop(self) -> Time:
        """The last point."""
        return self.at(self.count)

    def number(self, t: Time) -> int | None:
        """The number of the point at `t`; `None` if there is none."""
        elapsed = t - self.start
        if isinstance(self.step_size, int):
            whole, rest = divmod(elapsed, self.step_size)
            return None if rest else whole
        number = _nearest(elapsed / self.step_size)
        return number if self.at(number) == t else None

    def last(self, t: Time) -> int:
        """The number of the last point at or before `t`."""
        number = int((t - self.start) // self.step_size)
        return number + (self.at(number + 1) <= t)

    def before(self, t: Time) -> Time:
        """The point in front of the point at `t`."""
        if isinstance(self.step_size, int):
            return t - self.step_size
        return self.at(self.last(t) - 1)

    def after(self, t: Time) -> Time:
        """The first point behind `t`."""
        if isinstance(self.step_size, int):
            return t + self.step_size - (t - self.start) % self.step_size
        return self.at(self.last(t) + 1)

    def seconds(self, t: Time) -> float:
        """The float of seconds nearest to a point; to `t` itself, where there is no point."""
        if isinstance(self.step_size, int) or (number := self.number(t)) is None:
            return seconds(t)
        return float((self.start + number * self.step_size) / NANOSECONDS_PER_SECOND)

    def length(self, t: Time, h: Duration) -> float:
        """The float of seconds nearest to the step from `t` to `t + h`."""
        if isinstance(self.step_size, int):
            return seconds(h)
        first, last = self.number(t), self.number(t + h)
        if first is None or last is None:
            return seconds(h)
        return float((last - first) * self.step_size / NANOSECONDS_PER_SECOND)


@dataclass(frozen=True, slots=True)
class MultiRateGrid:
    """The communication points of several step sizes that start and end together.

    A step size meets the points `start + k * step_size`. Points that no step size meets do not
    exist, so an awkward greatest common divisor costs nothing.
    """

    start: Time
    stop: Time
    step_sizes: tuple[StepSize, ...]
    _grids: tuple[CommunicationGrid, ...] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        grids = tuple(CommunicationGrid.over(self.start, self.stop, h) for h in self.step_sizes)
        object.__setattr__(self, "_grids", grids)

    def __iter__(self) -> Iterator[tuple[Time, tuple[StepSize, ...]]]:
        """Yield each communication point with the step sizes that meet it, stop included."""
        t = self.start
        yield t, self.at(t)
        while t < self.stop and self.step_sizes:
            t = self.after(t)
            yield t, self.at(t)

    def at(self, t: Time) -> tuple[StepSize, ...]:
        """The step sizes that meet the communication point `t`."""
        elapsed = t - self.start
        return tuple(
            h
            for h, grid in zip(self.step_sizes, self._grids, strict=True)
            if (elapsed % h == 0 if isinstance(h, int) else grid.number(t) is not None)
        )

    def after(self, t: Time) -> Time:
        """The communication point after `t`, which is not the last one."""
        if len(self._grids) == 1:
            return self._grids[0].after(t)
        return min(grid.after(t) for grid in self._grids)
