"""Simulation time as integer nanoseconds.

Sums of integers are exact, so two components that meet at a communication point meet
at the same number. Seconds (`float`) exist only at the edges: scenarios and FMI calls.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction
from typing import Final, TypeAlias

Time: TypeAlias = int
"""A point in simulation time, in nanoseconds."""

Duration: TypeAlias = int
"""A span of simulation time, in nanoseconds."""

NANOSECONDS_PER_SECOND: Final = 1_000_000_000


def nanoseconds(seconds: str | float) -> Time:
    """Convert seconds, as written in a scenario file, to nanoseconds.

    Raises:
        ValueError: `seconds` is not a whole number of nanoseconds.
    """
    exact = Fraction(str(seconds)) * NANOSECONDS_PER_SECOND
    if exact.denominator != 1:
        raise ValueError(f"{seconds} s is not a whole number of nanoseconds")
    return int(exact)


def seconds(time: Time) -> float:
    """Convert nanoseconds to the nearest float of seconds, as FMI wants them."""
    return time / NANOSECONDS_PER_SECOND


def format_duration(time: Duration) -> str:
    """`time` in the largest unit that keeps it a whole number, e.g. `50 ms`."""
    for symbol, length in (("s", 10**9), ("ms", 10**6), ("us", 10**3)):
        if time % length == 0:
            return f"{time // length} {symbol}"
    return f"{time} ns"


@dataclass(frozen=True, slots=True)
class CommunicationGrid:
    """Equidistant communication points `start + k * step_size`, `k = 0, ..., count`."""

    start: Time
    step_size: Duration
    count: int

    def __post_init__(self) -> None:
        if self.step_size <= 0:
            raise ValueError(f"the step size must be positive, got {self.step_size} ns")
        if self.count < 0:
            raise ValueError(f"the number of steps must not be negative, got {self.count}")

    @classmethod
    def over(cls, start: Time, stop: Time, step_size: Duration) -> "CommunicationGrid":
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
                f"the interval of {stop - start} ns is not a whole number of steps of "
                f"{step_size} ns: {rest} ns are left over"
            )
        return cls(start, step_size, count)

    def __iter__(self) -> Iterator[Time]:
        """Yield the start of each communication step."""
        return (self.start + k * self.step_size for k in range(self.count))


@dataclass(frozen=True, slots=True)
class MultiRateGrid:
    """The communication points of several step sizes that start and end together.

    A step size meets the points `start + k * step_size`. Points that no step size meets do not
    exist, so an awkward greatest common divisor costs nothing.
    """

    start: Time
    stop: Time
    step_sizes: tuple[Duration, ...]

    def __post_init__(self) -> None:
        for step_size in self.step_sizes:
            CommunicationGrid.over(self.start, self.stop, step_size)

    def __iter__(self) -> Iterator[tuple[Time, tuple[Duration, ...]]]:
        """Yield each communication point with the step sizes that meet it, stop included."""
        t = self.start
        yield t, self.at(t)
        while t < self.stop and self.step_sizes:
            t = self.after(t)
            yield t, self.at(t)

    def at(self, t: Time) -> tuple[Duration, ...]:
        """The step sizes that meet the communication point `t`."""
        elapsed = t - self.start
        return tuple(h for h in self.step_sizes if elapsed % h == 0)

    def after(self, t: Time) -> Time:
        """The communication point after `t`, which is not the last one."""
        elapsed = t - self.start
        return self.start + min(elapsed - elapsed % h + h for h in self.step_sizes)
