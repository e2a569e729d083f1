"""Explicit methods of fixed step; events by bisection of the step they are in."""

import math
from collections.abc import Callable
from typing import Any, Final, TypeAlias

import numpy as np
from typing_extensions import override

from adapters.fmi.errors import FmuError
from adapters.fmi.model_exchange.solver import Problem, Reached, Solver
from orchestrator.signal import Array

Rates: TypeAlias = Callable[[float, Array], Array]
Method: TypeAlias = Callable[[Rates, float, Array, float], Array]
"""From f, t [s], x and h [s] to the x after one step."""

_ROUNDING: Final = 1e-12
"""A remainder of a step that is nothing but rounding, as a share of it."""


def euler(rates: Rates, t: float, x: Array, h: float) -> Array:
    """Explicit Euler, order 1.

    Args:
        rates: f, from t [s] and x to x', of shape (state,).
        t: where the step begins [s].
        x: the states there, shape (state,).
        h: its length [s].

    Returns:
        The states at its end, shape (state,).
    """
    return np.asarray(x + h * rates(t, x))


def rk4(rates: Rates, t: float, x: Array, h: float) -> Array:
    """The classical Runge-Kutta method, order 4.

    Args:
        rates: f, from t [s] and x to x', of shape (state,).
        t: where the step begins [s].
        x: the states there, shape (state,).
        h: its length [s].

    Returns:
        The states at its end, shape (state,).
    """
    k1 = rates(t, x)
    k2 = rates(t + h / 2, x + h / 2 * k1)
    k3 = rates(t + h / 2, x + h / 2 * k2)
    k4 = rates(t + h, x + h * k3)
    return np.asarray(x + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4))


class FixedStep(Solver):
    """Steps of one length, the last one before a stop shortened with those before it.

    Args:
        problem: to be integrated.
        method: of one step.
        step: its longest step [s]; infinite: as far as it is let.
    """

    def __init__(self, problem: Problem, method: Method, *, step: float) -> None:
        self._problem, self._method, self._step = problem, method, step
        self._t = 0.0
        self._states = np.zeros(problem.size)
        self._trial = np.zeros(problem.size)
        self._signs = np.zeros(problem.indicators, np.bool_)

    @property
    @override
    def states(self) -> Array:
        return self._states

    @override
    def restart(self, t: float, states: Array, nominals: Array) -> None:
        self._t = t
        self._states[:] = states
        self._signs = self._signs_at(t, self._states)

    @override
    def advance(self, stop: float) -> Reached:
        left = stop - self._t
        count = max(1, math.ceil(left / self._step - _ROUNDING))
        h = left / count
        end = stop if count == 1 else self._t + h
        found = self._method(self._rates, self._t, self._states, h)
        is_event = self._has_changed(end, found)
        if is_event:
            end, found = self._bisected(end, found)
        self._t = end
        self._states[:] = found
        return Reached(end, is_event=is_event)

    def _bisected(self, end: float, found: Array) -> tuple[float, Array]:
        """The first point of time behind a change of sign, and the states there."""
        low, high = self._t, end
        while low < (middle := (low + high) / 2) < high:
            states = self._method(self._rates, self._t, self._states, middle - self._t)
            if self._has_changed(middle, states):
                high, found = middle, states
            else:
                low = middle
        return high, found

    def _has_changed(self, t: float, states: Array) -> bool:
        return bool((self._signs_at(t, states) != self._signs).any())

    def _signs_at(self, t: float, states: Array) -> Any:
        values = np.zeros(self._problem.indicators)
        if values.size:
            self._trial[:] = states
            at, where = self._trial.ctypes.data, values.ctypes.data
            self._accept("event indicators", self._problem.signs(t, at, where), t)
        return values > 0

    def _rates(self, t: float, states: Array) -> Array:
        self._trial[:] = states
        found = np.zeros(len(states))
        at, where = self._trial.ctypes.data, found.ctypes.data
        self._accept("derivatives", self._problem.rates(t, at, where), t)
        return found

    def _accept(self, what: str, is_known: bool, t: float) -> None:  # noqa: FBT001
        if not is_known:
            raise FmuError(
                f"the FMU does not know its {what} at {t:.9g} s (Discard); a shorter `fmi.step`, "
                "or `fmi.solver: cvode`, which tries shorter steps, may help"
            )

    @override
    def free(self) -> None:
        pass
