"""The solvers that a scenario can choose."""

import math
from typing import Final

from adapters.fmi.model_exchange.cvode import CVode
from adapters.fmi.model_exchange.dormand_prince import DormandPrince
from adapters.fmi.model_exchange.one_step import FixedStep, Method, euler, rk4
from adapters.fmi.model_exchange.solver import Problem, Solver

CVODE: Final = "cvode"
_DOPRI: Final = "dopri5"
_METHODS: Final[dict[str, Method]] = {"rk4": rk4, "euler": euler}
NAMES: Final = (CVODE, _DOPRI, *_METHODS)


def is_controlled(name: str) -> bool:
    """Whether a solver has a tolerance, and no fixed step."""
    return name not in _METHODS


def made(name: str, problem: Problem, *, tolerance: float, step: float | None) -> Solver:
    """A new solver.

    Args:
        name: one of `NAMES`.
        problem: to be integrated.
        tolerance: relative, of those that have one.
        step: the longest step of the solver [s]; `None`: as far as it is let.

    Raises:
        ComponentTypeError: this machine does not have it.
    """
    longest = math.inf if step is None else step
    if name == CVODE:
        return CVode(problem, tolerance=tolerance, longest_step=longest)
    if name == _DOPRI:
        return DormandPrince(problem, tolerance=tolerance, longest_step=longest)
    return FixedStep(problem, _METHODS[name], step=longest)
