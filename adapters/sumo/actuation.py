"""Dead times between the ego's driving policy and its actuators."""

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import Final, Generic, TypeVar

from adapters.sumo.ego import RELEASED, Command
from orchestrator.timebase import NANOSECONDS_PER_SECOND, Duration, Time

Value = TypeVar("Value")


class TransportDelay(Generic[Value]):
    """What is given takes effect a constant time later, whenever that is."""

    def __init__(self, delay: Duration, initial: Value) -> None:
        """Let `initial` act until what is given first takes effect; `delay` in ns."""
        self._delay: Final = delay
        self._acting = initial
        self._newest = initial
        self._waiting: deque[tuple[Time, Value]] = deque()

    def give(self, now: Time, value: Value) -> None:
        """Give `value` at `now` [ns]; times never decrease."""
        if value != self._newest:
            self._newest = value
            self._waiting.append((now + self._delay, value))

    def at(self, t: float) -> Value:
        """What acts from `t` [ns] on; times never decrease."""
        while self._waiting and self._waiting[0][0] <= t:
            self._acting = self._waiting.popleft()[1]
        return self._acting

    def changes(self, begin: float, end: float) -> list[Time]:
        """When something takes effect after `begin` and before `end` [ns]."""
        return [t for t, _ in self._waiting if begin < t < end]


@dataclass(frozen=True, slots=True)
class Piece:
    """A span of time in which one command acts.

    Attributes:
        duration: [s].
        command: what the actuators do meanwhile.
    """

    duration: float
    command: Command


class Actuation:
    """Which command acts when: pedals and steering each have a dead time.

    Until the first command takes effect the pedals are released and the wheel is straight.
    """

    def __init__(self, pedal_delay: Duration, steering_delay: Duration) -> None:
        """Start with nothing commanded; both in ns."""
        self._pedals = TransportDelay(pedal_delay, (RELEASED.accelerate, RELEASED.brake))
        self._steer = TransportDelay(steering_delay, RELEASED.steer)

    def give(self, now: Time, command: Command) -> None:
        """The driving policy asks for `command` at `now` [ns]."""
        self._pedals.give(now, (command.accelerate, command.brake))
        self._steer.give(now, command.steer)

    def pieces(self, now: Time, step: Duration, count: int) -> Iterator[tuple[Piece, ...]]:
        """Cut a step into `count` equal parts, and these wherever a command takes effect.

        Args:
            now: when the step begins [ns].
            step: its duration [ns].
            count: number of parts.

        Yields:
            For each part its pieces, in order; one if nothing changes within it.
        """
        for k in range(count):
            begin, end = now + k * step / count, now + (k + 1) * step / count
            inner = {*self._pedals.changes(begin, end), *self._steer.changes(begin, end)}
            if not inner:
                duration = step / NANOSECONDS_PER_SECOND / count
                yield (Piece(duration, self._acting(begin)),)
                continue
            cuts = [begin, *sorted(inner), end]
            yield tuple(
                Piece((after - before) / NANOSECONDS_PER_SECOND, self._acting(before))
                for before, after in pairwise(cuts)
            )

    def _acting(self, t: float) -> Command:
        accelerate, brake = self._pedals.at(t)
        return Command(accelerate=accelerate, brake=brake, steer=self._steer.at(t))
