"""What the experiments of a page cost, and what they would cost with all seeds that they plan."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Protocol

from orchestrator.experiment.schema import seeds
from studies.method.origin import Origin
from studies.method.text import markdown

CORES: Final = 2
"""The cores that hours are given for."""

COST: Final = f"""\
*Time of workers*: of the processes that ran, one thread each, from the start of a run to its
metrics. It is processor time where experiments noted it, and else wall time, which is the same if a
worker has its core for itself, and else more. *Planned*: the runs of all {{seeds}} seeds, of
more where an experiment has more, at the same cost each, on {CORES} cores.
"""
"""What the table says; `seeds` is how many are planned."""


class Timed(Protocol):
    """A run that did not fail."""

    @property
    def wall_s(self) -> float:
        """Its wall time [s]."""
        ...

    @property
    def cpu_s(self) -> float | None:
        """Its processor time [s]; `None` if it was not noted."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class Spent:
    """What an experiment has cost so far.

    Attributes:
        name: of the experiment.
        runs: that did not fail.
        time: of their worker processes [s].
        planned: the number of runs with all seeds.
        is_wall: whether it is wall time, since the processor time of some run was not noted.
    """

    name: str
    runs: int
    time: float
    planned: int
    is_wall: bool

    @staticmethod
    def of(name: str, runs: Sequence[Timed], planned: int) -> "Spent":
        """What these runs, which did not fail, have cost.

        Args:
            name: of the experiment.
            runs: all that did not fail.
            planned: the number of runs with all seeds.
        """
        noted = [run.cpu_s for run in runs if run.cpu_s is not None]
        is_wall = len(noted) < len(runs)
        time = math.fsum([run.wall_s for run in runs] if is_wall else noted)
        return Spent(name=name, runs=len(runs), time=time, planned=planned, is_wall=is_wall)

    @property
    def each(self) -> float:
        """Time of a run [s]; 0 without runs."""
        return self.time / self.runs if self.runs else 0.0


def planned(origin: Origin, every: int) -> int:
    """The runs of all combinations of an experiment with `every` seeds instead of its own."""
    return origin.planned // len(seeds(origin.seeds)) * every


def table(found: Sequence[Spent]) -> str:
    """A row per experiment, and the sum."""
    head = ("experiment", "runs", "time of workers [h]", "which is", "per run [s]",
            "planned runs", f"planned, on {CORES} cores [h]")  # fmt: skip
    body = [
        [
            one.name,
            str(one.runs),
            f"{one.time / 3600:.2f}",
            "wall time" if one.is_wall else "processor time",
            f"{one.each:.2f}",
            str(one.planned),
            f"{one.each * one.planned / 3600 / CORES:.2f}",
        ]
        for one in found
    ]
    time = sum(one.time for one in found)
    whole = sum(one.each * one.planned for one in found)
    runs, all_planned = sum(one.runs for one in found), sum(one.planned for one in found)
    hours = f"{whole / 3600 / CORES:.2f}"
    total = ["all", str(runs), f"{time / 3600:.2f}", "", "", str(all_planned), hours]
    return markdown(head, [*body, total])
