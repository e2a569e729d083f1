"""Inputs that run on over a step as polynomials through what was published before."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final, Literal, TypeAlias

from typing_extensions import override

from orchestrator.algorithm.base import CosimulationAlgorithm, Stepping
from orchestrator.algorithm.exchange import Exchange
from orchestrator.parameters import parameter
from orchestrator.system import System

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
    def of_run(self, system: System, exchange: Exchange) -> Stepping:
        exchange.approximate(system, DEGREES[self.extrapolation], is_smooth=self.smooth)
        return self
