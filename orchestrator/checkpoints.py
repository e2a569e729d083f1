"""Checkpoints of a run, as the simulation loop sees them."""

import abc
from collections.abc import Callable, Collection
from dataclasses import dataclass
from typing import Final

from typing_extensions import override

from orchestrator.algorithm.base import Stepping
from orchestrator.algorithm.exchange import Exchange
from orchestrator.system import System
from orchestrator.timebase import Time


@dataclass(frozen=True, slots=True, kw_only=True)
class Standing:
    """A run whose components are initialised.

    Attributes:
        system: the components and their connections.
        exchange: their participants.
        stepping: who lets them step.
        compiled: names of those that compiled code steps where it can.
        start: the first communication point [ns].
        stop: the last one [ns].
        look_up: to be called now and then while steps are made again.
    """

    system: System
    exchange: Exchange
    stepping: Stepping
    compiled: Collection[str]
    start: Time
    stop: Time
    look_up: Callable[[], None]


@dataclass(frozen=True, slots=True, kw_only=True)
class Spent:
    """Wall time that a run took.

    Attributes:
        run_ns: all of it [ns].
        observers_ns: that of observers [ns].
    """

    run_ns: int = 0
    observers_ns: int = 0


class Checkpoints(abc.ABC):
    """Where a run begins, and where it leaves what it needs to go on from there."""

    @property
    @abc.abstractmethod
    def spent(self) -> Spent:
        """The wall time of what lies before the point where the run begins."""

    @property
    @abc.abstractmethod
    def are_wanted(self) -> bool:
        """Whether some are to be written, if that is possible."""

    @abc.abstractmethod
    def begin(self, standing: Standing) -> Time:
        """Bring a run from its start to where it begins; that point [ns]."""

    @abc.abstractmethod
    def is_due(self, t: Time) -> bool:
        """Whether a checkpoint is wanted at the communication point `t` [ns], and possible."""

    @abc.abstractmethod
    def limit(self, t: Time, stop: Time) -> Time:
        """The first point behind `t` for which one is wanted, or `stop` [ns]."""

    @abc.abstractmethod
    def keep(self, t: Time, spent: Spent) -> None:
        """Write one, at a point that is observed and where no step is under way.

        Args:
            t: the point [ns].
            spent: until now.
        """


class NoCheckpoints(Checkpoints):
    """None: the run begins at its start."""

    @property
    @override
    def spent(self) -> Spent:
        return Spent()

    @property
    @override
    def are_wanted(self) -> bool:
        return False

    @override
    def begin(self, standing: Standing) -> Time:
        return standing.start

    @override
    def is_due(self, t: Time) -> bool:
        return False

    @override
    def limit(self, t: Time, stop: Time) -> Time:
        return stop

    @override
    def keep(self, t: Time, spent: Spent) -> None:
        raise AssertionError("none is due")


NO_CHECKPOINTS: Final = NoCheckpoints()
