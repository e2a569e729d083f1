"""Where the CPU time goes, by switching models off one after the other."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

from benchmarks.benchmark import Measurement, Row
from benchmarks.spread import Spread

_UNIT: Final = "CPU s"


@dataclass(frozen=True, slots=True, kw_only=True)
class Stages:
    """One measurement of the same workload at each stage.

    Attributes:
        silent: nobody sends.
        free: free space, all receptions reported.
        buildings: with buildings.
        full: with buildings and vehicles.
    """

    silent: Measurement
    free: Measurement
    buildings: Measurement
    full: Measurement


_PARTS: Final[Mapping[str, Callable[[Stages], float]]] = {
    "set-up": lambda s: s.full["setup_s"],
    "importer and reading": lambda s: s.full["total_s"] - s.full["setup_s"] - s.full["fmu_s"],
    "scenes": lambda s: s.silent["fmu_s"],
    "medium access, frames and free space": lambda s: s.free["fmu_s"] - s.silent["fmu_s"],
    "buildings": lambda s: s.buildings["fmu_s"] - s.free["fmu_s"],
    "vehicles": lambda s: s.full["fmu_s"] - s.buildings["fmu_s"],
}
"""They add up to the time of the full models."""


def split_rows(case: str, runs: Mapping[str, Sequence[Measurement]]) -> Iterator[Row]:
    """One row per part, with its share of the whole.

    All receptions are reported at every stage, so that the number of records stays the same;
    that of frames decoded falls as obstacles are added, and the parts of the obstacles are net of
    that.

    Args:
        case: the first part of the names of the rows.
        runs: the repetitions of each stage, by the names of `Stages`.
    """
    complete = min(map(len, runs.values()))
    stages = [Stages(**{name: each[k] for name, each in runs.items()}) for k in range(complete)]
    whole = Spread.of(each.full["total_s"] for each in stages).median
    for name, part in _PARTS.items():
        spread = Spread.of(map(part, stages))
        yield Row(
            case=f"{case}/{name}",
            ours=spread.median,
            low=spread.low,
            high=spread.high,
            unit=_UNIT,
            is_higher_better=False,
            details={"share_percent": 100 * spread.median / whole},
        )
