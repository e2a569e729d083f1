"""What a benchmark is: cases that are measured, and rows that compare them with a peer."""

import abc
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any, Self, TypeAlias

from benchmarks.spread import Spread
from orchestrator.errors import CosimError

Measurement: TypeAlias = Mapping[str, float]
"""What one run of a case gave, by name; what the names mean is the benchmark's own business."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """One line of the result.

    Attributes:
        case: what was measured.
        ours: the median over the repetitions.
        low, high: the smallest and the largest of the repetitions.
        unit: of `ours` and of `peer`.
        peer: what the same work takes elsewhere; `None` if there is nothing to compare with.
        peer_name: who that is.
        is_higher_better: whether a larger number is the better one.
        details: further numbers, by name; names end in their unit.
    """

    case: str
    ours: float
    low: float
    high: float
    unit: str
    peer: float | None = None
    peer_name: str | None = None
    is_higher_better: bool = True
    details: Mapping[str, float] = field(default_factory=dict)

    @classmethod
    def of(
        cls,
        case: str,
        spread: Spread,
        unit: str,
        *,
        details: Mapping[str, float],
        peer: float | None = None,
        peer_name: str | None = None,
        is_higher_better: bool = True,
    ) -> Self:
        """The row of a case with this spread; without a number of the peer it has no name either.

        Args:
            case: what was measured.
            spread: of the repetitions.
            unit: of the spread and of `peer`.
            details: further numbers, by name.
            peer: what the same work takes elsewhere, if that is known.
            peer_name: who that is.
            is_higher_better: whether a larger number is the better one.
        """
        return cls(
            case=case,
            ours=spread.median,
            low=spread.low,
            high=spread.high,
            unit=unit,
            peer=peer,
            peer_name=None if peer is None else peer_name,
            is_higher_better=is_higher_better,
            details=details,
        )

    @property
    def ratio(self) -> float | None:
        """How many times better than the peer; below 1: worse."""
        if self.peer is None:
            return None
        return self.ours / self.peer if self.is_higher_better else self.peer / self.ours

    def as_json(self) -> dict[str, Any]:
        """The row as `nlosim bench --json` prints it."""
        return {**asdict(self), "ratio": self.ratio}

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> Self:
        """The row that `as_json` wrote."""
        return cls(**{name: value for name, value in data.items() if name != "ratio"})


class PeerFailedError(CosimError):
    """A program of others could not do its part; the text says how, with its name."""


class Case(abc.ABC):
    """One thing to be measured, again and again."""

    @abc.abstractmethod
    def measure(self) -> Measurement:
        """Do the work once; every call does the same work.

        What can be prepared beforehand is no part of what is timed. The numbers are finite.

        Raises:
            PeerFailedError: the case is that of a peer, which failed: it is left out.
        """


class Benchmark(abc.ABC):
    """A set of cases that are measured together.

    Offered by an entry point in the group `orchestrator.benchmarks`, which names a subclass whose
    constructor takes no arguments.
    """

    @property
    @abc.abstractmethod
    def description(self) -> str:
        """One sentence."""

    @property
    def peer(self) -> str:
        """Who the peer is, and where its numbers come from; empty if there is none."""
        return ""

    @property
    def settings(self) -> Mapping[str, str]:
        """What `--set` can change, and its values now; by name."""
        return {}

    def configure(self, settings: Mapping[str, str]) -> None:
        """Take other values; called once, before everything else.

        Args:
            settings: by names that `settings` has.
        """

    def require(self) -> None:
        """Raise a `CosimError` if something is missing that the cases need; called first."""

    @abc.abstractmethod
    def cases(self) -> Mapping[str, Case]:
        """The cases, prepared to be measured, by name; they are measured in this order."""

    @abc.abstractmethod
    def rows(self, measured: Mapping[str, Sequence[Measurement]]) -> Sequence[Row]:
        """The result.

        Args:
            measured: the repetitions of each case, at least one, by its name. Cases that were not
                asked for, or not reached before the user stopped, are missing.
        """
