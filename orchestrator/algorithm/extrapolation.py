"""Inputs that run on over a step as polynomials through what was published before."""

import abc
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Final, Literal, TypeAlias

from typing_extensions import override

from orchestrator.algorithm.base import CosimulationAlgorithm, Stepping
from orchestrator.algorithm.exchange import Exchange
from orchestrator.algorithm.history import approximated
from orchestrator.capabilities import CourseFollowing, PointEvaluation
from orchestrator.feedthrough import has_feedthrough
from orchestrator.parameters import parameter
from orchestrator.system import System
from orchestrator.timebase import StepSize, as_step_size

Extrapolation: TypeAlias = Literal["hold", "linear", "quadratic"]

DEGREES: Final[Mapping[str, int]] = {"hold": 0, "linear": 1, "quadratic": 2}
"""The degree of the polynomials as which inputs run over a step; 0: they are held."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ExtrapolatingAlgorithm(CosimulationAlgorithm):
    """Every step is made once, with inputs that are held, or run on as polynomials."""

    extrapolation: Extrapolation = parameter(
        "hold",
        doc="how continuous real inputs run over a step: held, or as polynomials through the last "
        "two or three values that were published",
    )
    smooth: bool = parameter(
        default=False,
        doc="let inputs that are extrapolated begin each step with the value that they ended the "
        "last one with",
    )

    @property
    def is_held(self) -> bool:
        """Whether inputs do not change over a step."""
        return self.extrapolation == "hold"

    @override
    def lags(self, system: System) -> Mapping[str, StepSize]:
        return {
            name: lag
            for name, component in system.components.items()
            if has_feedthrough(system, name)
            and component.capability(PointEvaluation) is None  # type: ignore[type-abstract]
            and (lag := self._lag(system, name))
        }

    def _lag(self, system: System, name: str) -> StepSize:
        """That of outputs which a step leaves with the inputs that it had."""
        step = system.step_sizes[name]
        if self.is_held or not approximated(system, name):
            return self._held_lag(step)
        follower = system.components[name].capability(CourseFollowing)  # type: ignore[type-abstract]
        mean = Fraction(step) / 2
        return 0 if follower is not None else as_step_size(mean)

    @abc.abstractmethod
    def _held_lag(self, step: StepSize) -> StepSize:
        """How old inputs are at the end of a step that held them, beside the age of what came."""

    @override
    def of_run(self, system: System, exchange: Exchange) -> Stepping:
        exchange.approximate(system, DEGREES[self.extrapolation], is_smooth=self.smooth)
        return self
