"""Who takes part in the benchmark, and one run of each."""

import abc
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from subprocess import TimeoutExpired

from typing_extensions import override

from benchmarks.benchmark import Case, Measurement, PeerFailedError
from benchmarks.distributed.children import BrokenProcessError
from benchmarks.distributed.ring import Ring, timing


class Participant(abc.ABC):
    """Something that can make a ring of processes go round.

    Attributes:
        label: what it is called in the result.
        share: of the steps of the others, that it makes; slower ones make fewer.
        most: members that it is asked for at most.
    """

    label: str
    share: float = 1.0
    most: int = 50

    @property
    def why_not(self) -> str:
        """Why it cannot be measured here; empty if it can."""
        return ""

    @abc.abstractmethod
    def stamps(self, ring: Ring, steps: int) -> Sequence[int]:
        """Start the processes, make `steps` steps, check the last values and end the processes.

        Returns:
            When each step began, and when the last one ended [ns].

        Raises:
            DifferentValuesError: the last values are wrong.
        """


def missing(module: str, package: str) -> str:
    """Why a package cannot be used; empty if it can."""
    return "" if find_spec(module) else f"`{package}` is not installed"


@dataclass(frozen=True, slots=True, kw_only=True)
class RingRun(Case):
    """One participant, one ring.

    Attributes:
        participant: who.
        ring: what.
        steps: macro steps that are timed.
    """

    participant: Participant
    ring: Ring
    steps: int

    @override
    def measure(self) -> Measurement:
        """Run once, a tenth more steps than are timed before them.

        Returns:
            `mean_ms`, `median_ms` and `p99_ms` of a macro step, wall time.
        """
        before = max(self.steps // 10, 5)
        try:
            stamps = self.participant.stamps(self.ring, before + self.steps)
        except (BrokenProcessError, TimeoutExpired) as error:  # ours starts no such process
            what = str(error).strip().splitlines()[-1]
            raise PeerFailedError(f"{self.participant.label} failed: {what}") from error
        return timing(stamps[before:])
