"""What a component published lately, and how its signals run over a step."""

from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from orchestrator.course import Course, Sample, course_through
from orchestrator.signal import Array, Connector, Signal, Signals, Variability
from orchestrator.system import Feed, System
from orchestrator.timebase import Duration, Time

_LONGEST: Final = 4
"""Publications that a polynomial may pass through."""


@dataclass(frozen=True, slots=True)
class _Publication:
    time: Time
    values: Signals
    slopes: Signals


class History:
    """The last publications of one component, each at another time."""

    __slots__ = ("_publications",)

    def __init__(self) -> None:
        self._publications: deque[_Publication] = deque(maxlen=_LONGEST)

    def put(self, t: Time, values: Signals, slopes: Signals) -> None:
        """Note what was published at `t`; what was published there, or later, is replaced."""
        self.forget_from(t)
        self._publications.append(_Publication(t, dict(values), slopes))

    def forget_from(self, t: Time) -> None:
        """Forget what was published at `t` and later: the component went back."""
        while self._publications and self._publications[-1].time >= t:
            self._publications.pop()

    def memory(self) -> list[Any]:
        """All of it, as `orchestrator.packing` takes it."""
        return [[each.time, each.values, each.slopes] for each in self._publications]

    def recall(self, memory: Sequence[Any]) -> None:
        """Know what `memory` told, in place of all else."""
        self._publications.clear()
        self._publications.extend(_Publication(*each) for each in memory)

    def course(self, output: str, t: Time, h: Duration, degree: int) -> Course:
        """How an output runs over a step, by what was published until now.

        Args:
            output: its name; a real signal that was published.
            t: where the step starts [ns].
            h: its length [ns].
            degree: of the polynomial at most.
        """
        samples: list[Sample] = []
        for each in reversed(self._publications):
            value = np.asarray(each.values[output])
            if samples and value.shape != samples[0].value.shape:
                break
            slope = each.slopes.get(output)
            scaled = None if slope is None else np.asarray(np.asarray(slope) * (h / 1e9))
            samples.append(Sample((each.time - t) / h, value, scaled))
        return course_through(samples, degree)


class InputCourses:
    """How the real inputs of one component run over its steps.

    Args:
        feeds: of these inputs.
        histories: of the components they come from, by name.
        degree: of the polynomials.
        is_smooth: whether each step begins with the value that the last one has ended with.
    """

    def __init__(
        self,
        feeds: Sequence[Feed],
        histories: Mapping[str, History],
        degree: int,
        *,
        is_smooth: bool,
    ) -> None:
        self._feeds = [(each.input, histories[each.component], each.output) for each in feeds]
        self._degree = degree
        self._is_smooth = is_smooth
        self._ends: dict[str, tuple[Time, Array]] = {}

    def over(self, t: Time, h: Duration) -> dict[str, Course]:
        """The courses over the step from `t` to `t + h` [ns], by input."""
        found = {}
        for name, history, output in self._feeds:
            course = history.course(output, t, h, self._degree)
            if self._is_smooth:
                course = self._joined(name, course, t, h)
            found[name] = course
        return found

    def memory(self) -> dict[str, Any]:
        """Where the courses ended, as `orchestrator.packing` takes it."""
        return {name: [time, end] for name, (time, end) in self._ends.items()}

    def recall(self, memory: Mapping[str, Any]) -> None:
        """Know what `memory` told, in place of all else."""
        self._ends = {name: (time, end) for name, (time, end) in memory.items()}

    def _joined(self, name: str, course: Course, t: Time, h: Duration) -> Course:
        """`course` moved so that it starts where the last one ended, and ends where it would."""
        time, end = self._ends.get(name, (None, course.at(0.0)))
        start = course.at(0.0)
        if time == t and end.shape == start.shape:
            gap = np.asarray(end - start)
            constant, *rest = course.coefficients
            slope = rest[0] if rest else np.zeros_like(constant)
            moved = (np.asarray(constant + gap), np.asarray(slope - gap), *rest[1:])
            course = Course(moved)
        self._ends[name] = (t + h, course.at(1.0))
        return course


def is_approximated(output: Connector, input_: Connector) -> bool:
    """Whether a signal is a continuous function of time at both ends, of a real type."""
    return all(
        not each.is_binary
        and np.dtype(each.dtype).kind == "f"
        and each.variability is Variability.CONTINUOUS
        for each in (output, input_)
    )


def approximated(system: System, name: str) -> tuple[Feed, ...]:
    """The feeds of a component whose signals are continuous functions of time."""
    own = system.connectors[name]
    return tuple(
        feed
        for feed in system.feeds[name]
        if is_approximated(system.connectors[feed.component][feed.output], own[feed.input])
    )


def real(value: Signal, like: Signal) -> Signal:
    """A computed value in the type of another one, read-only."""
    found = np.asarray(value, dtype=np.asarray(like).dtype)
    found.setflags(write=False)
    return found
