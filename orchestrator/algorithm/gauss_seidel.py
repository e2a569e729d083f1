"""The Gauss-Seidel (sequential) algorithm with held inputs."""

from collections import Counter
from dataclasses import dataclass

from typing_extensions import override

from orchestrator.algorithm.base import CosimulationAlgorithm
from orchestrator.algorithm.exchange import Due
from orchestrator.errors import SystemStructureError
from orchestrator.feedthrough import describe, feedthrough_order, loops
from orchestrator.suggestion import suggestion
from orchestrator.system import System
from orchestrator.timebase import Time


@dataclass(frozen=True, slots=True)
class GaussSeidel(CosimulationAlgorithm):
    """Components take turns; each sees the newest outputs of those before it.

    A component whose step ends at `t` steps when `t` is reached, over `t - H` to `t`. It sees
    the outputs at `t` of the components before it in the order, and of those behind it what they
    published before `t`. Its own outputs are published at once, so that a chain of direct
    feedthrough in this order has no delay.

    Attributes:
        order: the names of all components, first to step first; `None` for the order
            of direct feedthrough, which exists unless there is an algebraic loop.
    """

    order: tuple[str, ...] | None = None

    @override
    def turns(self, system: System) -> tuple[str, ...]:
        if self.order is None:
            found = loops(system)
            if found:
                raise SystemStructureError([describe(loop) for loop in found])
            return feedthrough_order(system)
        problems = _order_problems(self.order, tuple(system.components))
        if problems:
            raise SystemStructureError(problems)
        return self.order

    @override
    def depart(self, t: Time, due: Due) -> None:
        pass

    @override
    def arrive(self, t: Time, due: Due) -> None:
        # a wave at a time gives the same values as one at a time, and lets concurrent
        # components work side by side
        for wave in due.waves:
            for participant in wave:
                participant.begin(t - participant.step_size)
            for participant in wave:
                participant.finish()
                participant.publish()


def _order_problems(order: tuple[str, ...], components: tuple[str, ...]) -> list[str]:
    count = Counter(order)
    return [
        *(
            f"the Gauss-Seidel order names `{name}`, which is no component; "
            f"{suggestion(name, components)}"
            for name in count
            if name not in components
        ),
        *(
            f"the Gauss-Seidel order names `{name}` {times} times; name it once"
            for name, times in count.items()
            if times > 1
        ),
        *(
            f"the Gauss-Seidel order does not name the component `{name}`"
            for name in components
            if name not in count
        ),
    ]
