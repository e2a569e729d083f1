"""A step as its component can make it when inputs change over it."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from orchestrator.algorithm.history import InputCourses, real
from orchestrator.capabilities import CourseFollowing, PointEvaluation, VariableSteps
from orchestrator.component import Component
from orchestrator.course import Course
from orchestrator.signal import Signals
from orchestrator.timebase import Duration, Time


@dataclass(frozen=True, slots=True)
class Piece:
    """A step, or a part of one.

    Attributes:
        inputs: of the step; of those in `courses`, the values at its start.
        t: where it starts [ns].
        h: its length [ns].
        courses: of the inputs that change over it, by name.
    """

    inputs: Signals
    t: Time
    h: Duration
    courses: Mapping[str, Course] = field(default_factory=dict)


class Pieces:
    """Makes of a step with changing inputs what a component can do.

    A polynomial is followed, if the component can follow one of its degree; else it becomes the
    best one that it can follow, or its mean over the step; or two constants over one half each,
    where the polynomial is of degree 2 and the component may be stepped so. All of these have the
    moments of the polynomial that the order of the coupling takes.

    Args:
        component: the one that steps.
        courses: of its inputs.
    """

    def __init__(self, component: Component, courses: InputCourses) -> None:
        self._component = component
        self._courses = courses
        self._point = component.capability(PointEvaluation)  # type: ignore[type-abstract]
        self._ends: Signals | None = None
        self._follower = component.capability(CourseFollowing)  # type: ignore[type-abstract]
        self._may_cut = component.capability(VariableSteps) is not None

    def of(self, inputs: Signals, t: Time, h: Duration) -> tuple[Piece, ...]:
        """The pieces of the step from `t` to `t + h` [ns], in their order.

        Args:
            inputs: as they would be held.
            t: where it starts [ns].
            h: its length [ns].
        """
        courses = self._courses.over(t, h)
        if self._follower is not None:
            courses = {n: c.projected(self._follower.input_degree) for n, c in courses.items()}
            starts = {n: real(c.at(0.0), inputs[n]) for n, c in courses.items()}
            return (Piece({**inputs, **starts}, t, h, courses),)
        ends = {n: real(c.at(1.0), inputs[n]) for n, c in courses.items()}
        self._ends = {**inputs, **ends}
        if self._may_cut and h > 1 and any(c.degree > 1 for c in courses.values()):
            first = h // 2
            halves = {n: c.halves(first / h) for n, c in courses.items()}
            before, behind = (
                {**inputs, **{n: real(both[k], inputs[n]) for n, both in halves.items()}}
                for k in range(2)
            )
            return Piece(before, t, first), Piece(behind, t + first, h - first)
        means = {n: real(c.projected(0).at(0.0), inputs[n]) for n, c in courses.items()}
        return (Piece({**inputs, **means}, t, h),)

    def memory(self) -> dict[str, Any]:
        """What it knows of the last step, as `orchestrator.packing` takes it."""
        return self._courses.memory()

    def recall(self, memory: Mapping[str, Any]) -> None:
        """Know what `memory` told, in place of all else."""
        self._courses.recall(memory)

    def outputs(self) -> Signals:
        """The outputs at the end of the step, for the inputs there, if the component can say so.

        Without, direct feedthrough would publish what belongs to the means.
        """
        if self._ends is None or self._point is None:
            return self._component.outputs()
        return self._point.evaluate(self._ends)

    def follow(self, piece: Piece) -> frozenset[str]:
        """Tell the component how its inputs run over a piece that comes next.

        Returns:
            The inputs of which it knows how they change.
        """
        if self._follower is None or not piece.courses:
            return frozenset()
        self._follower.follow(piece.courses)
        return frozenset(name for name, course in piece.courses.items() if course.degree > 0)
