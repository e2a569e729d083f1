"""What every participant computes: a ring of processes that hand on an array."""

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Final

import numpy as np

from benchmarks.benchmark import Measurement
from orchestrator.errors import CosimError
from orchestrator.signal import Array

SEQUENTIAL: Final = "gauss-seidel"
PARALLEL: Final = "jacobi"


class DifferentValuesError(CosimError):
    """A participant did not compute what it should."""


@dataclass(frozen=True, slots=True)
class Ring:
    """Members that each add 1 to every element of what the one before gives.

    Numbers are whole and small, so that every value is exact.

    Attributes:
        size: of the array that each member hands on [byte], a multiple of 8.
        algorithm: `jacobi`: all see what was there before the step; `gauss-seidel`: in turns, each
            sees what the one before it has just made.
        members: how many processes; at least 2.
    """

    size: int
    algorithm: str
    members: int = 5

    @property
    def name(self) -> str:
        """Members, algorithm and size, as a case is called."""
        return f"{self.members}-{self.algorithm}/{self.size}B"

    @property
    def length(self) -> int:
        """Elements of an array."""
        return self.size // 8

    def to_text(self) -> str:
        """The ring as an argument of a process."""
        return json.dumps(asdict(self))

    @classmethod
    def from_text(cls, text: str) -> "Ring":
        """The ring that `to_text` wrote."""
        return cls(**json.loads(text))

    def start(self, member: int) -> Array:
        """What a member gives before the first step; different for each element of each member.

        Returns:
            Whole numbers [1], shape (size / 8,).
        """
        return np.arange(self.length, dtype=np.float64) + float(member * self.length)

    def last(self, member: int, steps: int) -> Array:
        """What a member gives after `steps` steps.

        Returns:
            Whole numbers [1], shape (size / 8,).
        """
        if self.algorithm == PARALLEL:
            return self.start((member - steps) % self.members) + float(steps)
        return self.start(self.members - 1) + float((steps - 1) * self.members + member + 1)

    def is_last(self, member: int, found: Array, steps: int) -> bool:
        """Whether a member gives what it should after `steps` steps, in every element.

        Args:
            member: which one.
            found: what it gives [1], shape (size / 8,).
            steps: how many were made.
        """
        return np.array_equal(found, self.last(member, steps))

    def check(self, who: str, right: Sequence[bool], steps: int) -> None:
        """Complain of wrong values.

        Args:
            who: computed them.
            right: for each member, whether it gave what it should at last.
            steps: how many were made.

        Raises:
            DifferentValuesError: a member gave something else, or is missing.
        """
        wrong = [member for member in range(self.members) if right[member : member + 1] != [True]]
        if wrong:
            raise DifferentValuesError(
                f"{self.name}: {who} gave other values than it should after {steps} steps: "
                f"members {', '.join(map(str, wrong))}"
            )


def timing(stamps_ns: Sequence[int]) -> Measurement:
    """What steps took.

    Args:
        stamps_ns: when each step began, and when the last one ended [ns]; at least two.

    Returns:
        `mean_ms`, `median_ms` and `p99_ms` of a step, wall time.
    """
    steps = np.diff(np.asarray(stamps_ns, np.float64)) * 1e-6
    return {
        "mean_ms": float(steps.mean()),
        "median_ms": float(np.median(steps)),
        "p99_ms": float(np.quantile(steps, 0.99)),
    }
