"""Interface quasi-Newton iteration: loops that do not contract are solved as well."""

from dataclasses import dataclass

from typing_extensions import override

from orchestrator.algorithm.acceleration import Acceleration, QuasiNewton
from orchestrator.algorithm.iterative import IterativeAlgorithm
from orchestrator.parameters import parameter


@dataclass(frozen=True, slots=True, kw_only=True)
class InterfaceQuasiNewton(IterativeAlgorithm):
    """Components that depend on each other step again until they agree, by interface quasi-Newton.

    See `IterativeAlgorithm`; what a repetition sees is computed from all repetitions before it in
    the same step (IQN-ILS, see `orchestrator.algorithm.acceleration.QuasiNewton`). It needs no
    loop that contracts: a linear one of `n` real signals is solved by `n` + 2 repetitions,
    whatever its gain.
    """

    relaxation: float = parameter(
        1.0,
        minimum=0.001,
        maximum=1,
        doc="share of the first change that the second repetition sees; less where components "
        "cannot step with what the first one gives",
    )

    @override
    def acceleration(self) -> Acceleration:
        return QuasiNewton(self.relaxation)

    @override
    def advice(self) -> str:
        return (
            "the loop may have no solution here, or more than one: try a smaller step, "
            "`relaxation` below 1, or more `maximum_iterations`"
        )

    @override
    def _noun(self) -> str:
        return "quasi-Newton iteration"
