"""Fixed-point iteration: components that depend on each other step until they agree."""

from dataclasses import dataclass

from typing_extensions import override

from orchestrator.algorithm.acceleration import Acceleration, Relaxation
from orchestrator.algorithm.iterative import IterativeAlgorithm
from orchestrator.parameters import parameter


@dataclass(frozen=True, slots=True, kw_only=True)
class FixedPoint(IterativeAlgorithm):
    """Components that depend on each other step again and again, until their outputs agree.

    See `IterativeAlgorithm`; each repetition sees what the one before has given (Kuebler and
    Schiehlen, "Two methods of simulator coupling", Math. Comput. Model. Dyn. Syst. 6(2), 2000).
    It converges where the loop contracts: the error shrinks by the loop gain each time.
    """

    relaxation: float = parameter(
        1.0,
        minimum=0.01,
        maximum=1,
        doc="share of each change that the next repetition sees; below 1 where the loop gain is "
        "below -1",
    )

    @override
    def acceleration(self) -> Acceleration:
        return Relaxation(self.relaxation)

    @override
    def advice(self) -> str:
        return (
            "the loop may not contract: try a smaller step, `relaxation` below 1, "
            "`algorithm: quasi-newton`, or more `maximum_iterations`"
        )

    @override
    def _noun(self) -> str:
        return "fixed-point iteration"
