"""The method of Dormand and Prince: explicit, order 5, its step controlled by one of order 4.

J. R. Dormand, P. J. Prince: A family of embedded Runge-Kutta formulae. Journal of Computational and
Applied Mathematics 6 (1980), 19-26, RK5(4)7M.
"""

import math
from typing import Final

import numpy as np
from typing_extensions import override

from adapters.fmi.errors import FmuError
from adapters.fmi.model_exchange.evaluation import Evaluation, UnknownPointError
from adapters.fmi.model_exchange.solver import Problem, Reached, Solver
from orchestrator.signal import Array

_NODES: Final = (1 / 5, 3 / 10, 4 / 5, 8 / 9, 1.0)
_STAGES: Final = (
    (1 / 5,),
    (3 / 40, 9 / 40),
    (44 / 45, -56 / 15, 32 / 9),
    (19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729),
    (9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656),
)
_WEIGHTS: Final = (35 / 384, 0.0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84)
_ERRORS: Final = (
    *(71 / 57600, 0.0, -71 / 16695, 71 / 1920, -17253 / 339200, 22 / 525),
    -1 / 40,
)
_SAFETY, _LEAST, _MOST = 0.9, 0.2, 5.0
"""What the next step keeps of the length that the tolerance allows; least and most change."""


class DormandPrince(Solver):
    """Variable step, and no memory beyond a restart: the right one for many short intervals.

    Args:
        problem: to be integrated.
        tolerance: relative; the absolute one of a state is 0.01 of it times its nominal value.
        longest_step: upper bound of its steps [s].
    """

    def __init__(
        self, problem: Problem, *, tolerance: float, longest_step: float = math.inf
    ) -> None:
        self._evaluation = Evaluation(problem)
        self._tolerance, self._longest = tolerance, longest_step
        self._t = 0.0
        self._states = np.zeros(problem.size)
        self._absolute: Array = np.zeros(problem.size)
        self._signs: Array = np.zeros(problem.indicators, np.bool_)
        self._planned = math.inf

    @property
    @override
    def states(self) -> Array:
        return self._states

    @override
    def restart(self, t: float, states: Array, nominals: Array) -> None:
        self._t = t
        self._states[:] = states
        self._absolute = 0.01 * self._tolerance * nominals
        self._signs = self._evaluation.signs(t, self._states)
        self._planned = math.inf

    @override
    def advance(self, stop: float) -> Reached:
        start, left = self._t, stop - self._t
        h = min(left, self._longest, self._planned)
        why = ""
        while True:
            end = stop if h >= left else start + h
            if end <= start:
                what = "its steps have become too short for the time to go on"
                raise FmuError(f"the solver failed at {start:.9g} s: {what}{why}")
            try:
                found, error = self._tried(end - start)
                is_event = bool((self._evaluation.signs(end, found) != self._signs).any())
            except UnknownPointError as unknown:
                why = f"; {unknown}"
                h = min(h, left) / 2
                continue
            if error <= 1.0:
                break
            h = min(h, left) * max(_LEAST, _SAFETY * error**-0.2)
        self._planned = (end - start) * min(_MOST, _SAFETY * max(error, 1e-10) ** -0.2)
        if is_event:
            end, found = self._evaluation.first_change(
                self._signs, (start, end), lambda t: self._tried(t - start)[0]
            )
        self._t = end
        self._states[:] = found
        return Reached(end, is_event=is_event)

    def _tried(self, h: float) -> tuple[Array, float]:
        """The states after a step of length `h`, and its error as a share of the tolerance."""
        rates, t, x = self._evaluation.rates, self._t, self._states
        slopes = [rates(t, x)]
        for node, row in zip(_NODES, _STAGES, strict=True):
            slopes.append(rates(t + node * h, x + h * _combined(row, slopes)))
        found = np.asarray(x + h * _combined(_WEIGHTS, slopes))
        slopes.append(rates(t + h, found))
        scale = self._absolute + self._tolerance * np.maximum(abs(x), abs(found))
        errors = h * _combined(_ERRORS, slopes) / scale
        error = math.sqrt(float(np.mean(errors**2)))
        return found, error if math.isfinite(error) else math.inf

    @override
    def free(self) -> None:
        pass


def _combined(weights: tuple[float, ...], slopes: list[Array]) -> Array:
    total = np.zeros_like(slopes[0])
    for weight, slope in zip(weights, slopes, strict=True):
        total += weight * slope
    return total
