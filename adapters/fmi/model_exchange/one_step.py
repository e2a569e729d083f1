"""Explicit methods of fixed step; events by bisection of the step they are in."""

import math
from collections.abc import Callable
from typing import Final, TypeAlias

import numpy as np
from typing_extensions import override

from adapters.fmi.errors import FmuError
from adapters.fmi.model_exchange.evaluation import Evaluation, UnknownPointError
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
        self._evaluation = Evaluation(problem)
        self._method, self._step = method, step
        self._t = 0.0
        self._states = np.zeros(problem.size)
        self._signs: Array = np.zeros(problem.indicators, np.bool_)

    @property
    @override
    def states(self) -> Array:
        return self._states

    @override
    def restart(self, t: float, states: Array, nominals: Array) -> None:
        self._t = t
        self._states[:] = states
        self._signs = self._evaluation.signs(t, self._states)

    @override
    def advance(self, stop: float) -> Reached:
        left = stop - self._t
        count = max(1, math.ceil(left / self._step - _ROUNDING))
        end = stop if count == 1 else self._t + left / count
        try:
            return self._stepped(end)
        except UnknownPointError as error:
            hint = "a shorter `fmi.step`, or a solver that tries shorter steps, may help"
            raise FmuError(f"{error}; {hint}") from None

    def _stepped(self, end: float) -> Reached:
        start = self._t

        def states_at(t: float) -> Array:
            return self._method(self._evaluation.rates, start, self._states, t - start)

        found = states_at(end)
        is_event = bool((self._evaluation.signs(end, found) != self._signs).any())
        if is_event:
            end, found = self._evaluation.first_change(self._signs, (start, end), states_at)
        self._t = end
        self._states[:] = found
        return Reached(end, is_event=is_event)

    @override
    def free(self) -> None:
        pass
