"""How a real signal runs over one step: a polynomial."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from orchestrator.signal import Array

_BEST: Final = {
    0: ((1.0,), (1 / 2,), (1 / 3,), (1 / 4,)),
    1: ((1.0,), (0.0, 1.0), (-1 / 6, 1.0), (-1 / 5, 9 / 10)),
    2: ((1.0,), (0.0, 1.0), (0.0, 0.0, 1.0), (1 / 20, -3 / 5, 3 / 2)),
}
"""The best approximation of 1, x, x^2, x^3 in the mean square over [0, 1], by degree."""


@dataclass(frozen=True, slots=True, eq=False)
class Course:
    """A signal over a step from `t` to `t + h`: c_0 + c_1 x + c_2 x^2 + ..., x = (s - t) / h.

    Attributes:
        coefficients: c_0, c_1, ... [unit of the signal], each of its shape.
    """

    coefficients: tuple[Array, ...]

    def at(self, x: float) -> Array:
        """The value at a share `x` of the step, of the shape of the signal: 0 is its start."""
        value = self.coefficients[-1]
        for c in reversed(self.coefficients[:-1]):
            value = value * x + c
        return np.asarray(value)

    @property
    def degree(self) -> int:
        """The degree of the polynomial."""
        return len(self.coefficients) - 1

    def projected(self, degree: int) -> "Course":
        """The course of this degree with the same moments, of order 0 to `degree`, over the step.

        A linear subsystem that follows it makes an error of order `degree` + 2 in one step, as
        small as that of the whole course would be after an interpolation of degree `degree` + 1.

        Args:
            degree: 0 to 2; 0 is the mean over the step.
        """
        if degree >= self.degree:
            return self
        shares = _BEST[degree]
        found = [np.zeros_like(self.coefficients[0]) for _ in range(degree + 1)]
        for c, powers in zip(self.coefficients, shares, strict=False):
            for k, share in enumerate(powers):
                found[k] = np.asarray(found[k] + share * c)
        return Course(tuple(found))

    def halves(self, x: float) -> tuple[Array, Array]:
        """Two constants, up to a share `x` of the step and behind it, with its moments 0 and 1.

        Args:
            x: between 0 and 1.

        Returns:
            Both of the shape of the signal.
        """
        mean = sum((c / (k + 1) for k, c in enumerate(self.coefficients)), np.zeros(()))
        moment = sum((c / (k + 2) for k, c in enumerate(self.coefficients)), np.zeros(()))
        second = (2 * moment - x * mean) / (1 - x)
        first = (mean - (1 - x) * second) / x
        return np.asarray(first), np.asarray(second)


@dataclass(frozen=True, slots=True, eq=False)
class Sample:
    """What is known of a signal at one time.

    Attributes:
        time: as a share of a step, see `Course`.
        value: of the signal.
        slope: its derivative with respect to that share; `None` if it is not known.
    """

    time: float
    value: Array
    slope: Array | None = None


def course_through(samples: Sequence[Sample], degree: int) -> Course:
    """The polynomial through samples, by divided differences.

    Args:
        samples: newest first, at different times, at least one. A known slope counts as a second
            sample at the same time.
        degree: at most this; with fewer samples it is what they determine.
    """
    times: list[float] = []
    table: list[Array] = []  # the divided differences that end at the newest node so far
    newton: list[Array] = []
    previous: list[Array] = []
    for sample in samples:
        for slope in (None, sample.slope):
            is_repeated = bool(times) and times[-1] == sample.time
            if len(times) > degree or (is_repeated and slope is None):
                continue
            times.append(sample.time)
            table = [sample.value]
            for k, lower in enumerate(previous):
                gap = times[-1] - times[-2 - k]
                difference = table[k] - lower
                table.append(np.asarray(slope if gap == 0.0 else difference / gap))
            newton.append(table[-1])
            previous = table
    coefficients = [np.zeros_like(newton[0])]
    for time, difference in zip(reversed(times), reversed(newton), strict=True):
        shifted = [np.zeros_like(newton[0]), *coefficients]
        for k, c in enumerate(coefficients):
            shifted[k] = np.asarray(shifted[k] - time * c)
        shifted[0] = np.asarray(shifted[0] + difference)
        coefficients = shifted
    return Course(tuple(coefficients[: len(newton)]))
