"""A problem as methods in Python evaluate it: arrays in, arrays out."""

from collections.abc import Callable

import numpy as np

from adapters.fmi.model_exchange.solver import Problem
from orchestrator.signal import Array


class UnknownPointError(Exception):
    """The problem cannot be evaluated at a point; another one may be tried."""

    def __init__(self, what: str, t: float) -> None:
        super().__init__(f"the FMU does not know its {what} at {t:.9g} s (Discard)")


class Evaluation:
    """Evaluates a problem.

    Args:
        problem: the problem.
    """

    def __init__(self, problem: Problem) -> None:
        self._problem = problem
        self._states = np.zeros(problem.size)

    def rates(self, t: float, states: Array) -> Array:
        """The derivatives f(t, x).

        Args:
            t: the time [s].
            states: x, shape (state,).

        Returns:
            Shape (state,).

        Raises:
            UnknownPointError: the problem does not know them there.
        """
        self._states[:] = states
        found = np.zeros(self._problem.size)
        if not self._problem.rates(t, self._states.ctypes.data, found.ctypes.data):
            raise UnknownPointError("derivatives", t)
        return found

    def signs(self, t: float, states: Array) -> Array:
        """Where the functions that mark events are positive; as `rates`.

        Args:
            t: the time [s].
            states: x, shape (state,).

        Returns:
            Bool, shape (indicator,).
        """
        values = np.zeros(self._problem.indicators)
        if values.size:
            self._states[:] = states
            if not self._problem.signs(t, self._states.ctypes.data, values.ctypes.data):
                raise UnknownPointError("event indicators", t)
        return np.asarray(values > 0)

    def first_change(
        self, signs: Array, span: tuple[float, float], states_at: Callable[[float], Array]
    ) -> tuple[float, Array]:
        """The first point of time behind a change of a sign, found by bisection.

        Args:
            signs: at the beginning, bool, shape (indicator,).
            span: where they are these, and where they are not any more [s].
            states_at: the states at a time [s] within, shape (state,).

        Returns:
            The time [s], and the states there, shape (state,).
        """
        low, high = span
        found = states_at(high)
        while low < (middle := (low + high) / 2) < high:
            states = states_at(middle)
            if (self.signs(middle, states) != signs).any():
                high, found = middle, states
            else:
                low = middle
        return high, found
