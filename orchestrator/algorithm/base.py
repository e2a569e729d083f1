"""The interface of a co-simulation algorithm."""

import abc

from orchestrator.algorithm.exchange import Due
from orchestrator.system import System
from orchestrator.timebase import Time


class CosimulationAlgorithm(abc.ABC):
    """Decides who steps when, and which values it sees.

    An algorithm is immutable and keeps no state of a run. At every communication point `t` the
    simulation calls `arrive` with those whose steps end at `t` (not at the first point), shows
    the published outputs to the observers, and calls `depart` with those whose steps start at
    `t` (not at the last point; they are the same, as every step starts where the last ended).
    """

    @abc.abstractmethod
    def turns(self, system: System) -> tuple[str, ...]:
        """The order in which the components of `system` take turns, each named once.

        Called once, before the run.

        Raises:
            SystemStructureError: the algorithm cannot be applied to `system`.
        """

    @abc.abstractmethod
    def depart(self, t: Time, due: Due) -> None:
        """Start the steps that start at `t`."""

    @abc.abstractmethod
    def arrive(self, t: Time, due: Due) -> None:
        """Complete the steps that end at `t` and publish their outputs."""
