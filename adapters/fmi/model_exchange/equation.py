"""The differential equation of an FMU, as solvers see it."""

import ctypes
from collections.abc import Callable
from typing import TypeAlias

import numpy as np
from typing_extensions import override

from adapters.fmi.model_exchange.functions import ContinuousFunctions
from adapters.fmi.model_exchange.solver import Problem
from orchestrator.signal import Array

DriveInputs: TypeAlias = Callable[[float], None]
"""Sets the inputs that change with time to their values at a time [s]."""


class Equation(Problem):
    """Evaluated by calls of the FMU.

    Args:
        functions: of the instance.
        states: number of its continuous states. Without any, one that never changes takes their
            place, so that a solver has something to integrate while it looks for events.
        indicators: number of its event indicators.
        references: value references of the states and of their derivatives, uint32, if the
            FMU knows directional derivatives and each is a scalar.

    Attributes:
        drive: sets inputs, while some follow a course; `None`: all are constant.
    """

    def __init__(
        self,
        functions: ContinuousFunctions,
        states: int,
        indicators: int,
        references: tuple[Array, Array] | None,
    ) -> None:
        self._functions = functions
        self._count = states
        self.size = max(states, 1)
        self.indicators = indicators
        self._references = references
        self.has_jacobian = references is not None
        self.drive: DriveInputs | None = None

    def move(self, t: float, states: int) -> bool:
        """Take the FMU to a time and to states."""
        functions = self._functions
        if not functions.set_time(t):
            return False
        if self.drive is not None:
            self.drive(t)
        return not self._count or functions.set_states(states, self._count)

    @override
    def rates(self, t: float, states: int, rates: int) -> bool:
        if not self.move(t, states):
            return False
        if not self._count:
            ctypes.memset(rates, 0, 8 * self.size)
            return True
        return self._functions.get_rates(rates, self._count)

    @override
    def signs(self, t: float, states: int, values: int) -> bool:
        return self.move(t, states) and self._functions.get_indicators(values, self.indicators)

    @override
    def jacobian(self, t: float, states: int, columns: Array) -> bool:
        if self._references is None or not self.move(t, states):
            return False
        knowns, unknowns = self._references
        seed = np.ones(1)
        return all(
            self._functions.directional(unknowns, knowns[k : k + 1], seed, columns[k])
            for k in range(self.size)
        )
