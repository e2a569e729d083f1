"""The CPU time that FMUs take, apart from that of their importer."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from time import process_time_ns
from unittest.mock import patch

from adapters.fmi.fmi3 import Fmi3Instance
from adapters.fmi.outcome import StepOutcome


@dataclass(slots=True)
class StepClock:
    """CPU time that was spent in steps of FMUs [ns]."""

    spent: int = 0


@contextmanager
def step_clock() -> Iterator[StepClock]:
    """While the block runs, the steps of every FMI 3.0 instance are timed.

    The importer has no such clock of its own: two readings of the process clock per step, about a
    microsecond, are for benchmarks only.
    """
    clock = StepClock()
    step = Fmi3Instance.step

    def timed(self: Fmi3Instance, t: float, h: float) -> StepOutcome:
        before = process_time_ns()
        outcome = step(self, t, h)
        clock.spent += process_time_ns() - before
        return outcome

    with patch.object(Fmi3Instance, "step", timed):
        yield clock
