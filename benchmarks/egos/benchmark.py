"""`nlosim bench egos`."""

import tempfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from time import process_time_ns
from typing import Final

from typing_extensions import override

import scenarios
from benchmarks.benchmark import Benchmark, Case, Measurement, Row
from benchmarks.spread import Spread
from orchestrator.run import run_scenario
from orchestrator.scenario.build import load_scenario
from orchestrator.timebase import NANOSECONDS_PER_SECOND

SCENARIO: Final = Path(scenarios.__file__).parent / "ten_egos.yaml"

_EGOS: Final = (
    "south", "follower", "north", "south_3", "right_1", "right_2", "right_3", "north_2", "north_3",
    "north_4",
)  # fmt: skip
_COUNTS: Final = (1, 2, 5, 10)
_STOP: Final = "time.stop=10 s"


def settings(count: int) -> Sequence[str]:
    """What `--set` says so that only the first `count` egos of the scenario take part."""
    present, absent = _EGOS[:count], _EGOS[count:]
    entities = "components.traffic.parameters.entities"
    nobody = [f"{entities}.{name}=null" for name in absent]
    return [f"each.ego=[{', '.join(present)}]", _STOP, *nobody]


@dataclass(frozen=True, kw_only=True, eq=False)
class EgosRun(Case):
    """One run of the scenario, all components in one process, with only some of the egos.

    Attributes:
        count: how many of them take part, each with a lidar, perception, relay and policy.
    """

    count: int

    @override
    def measure(self) -> Measurement:
        """Run once.

        Returns:
            `cpu_s`: CPU seconds per simulated second, loading and recording included.
        """
        before = process_time_ns()
        scenario = load_scenario(SCENARIO, settings(self.count))
        with tempfile.TemporaryDirectory() as folder:
            outcome = run_scenario(scenario, Path(folder) / "run", figure=False)
        spent = (process_time_ns() - before) / NANOSECONDS_PER_SECOND
        return {"cpu_s": spent / outcome.simulated}


class EgosBenchmark(Benchmark):
    """Runs with one to ten ego vehicles, beside as many runs with one."""

    @property
    @override
    def description(self) -> str:
        return (
            "ego vehicles in one run, each with lidar, perception, relay and rule-based policy in "
            "the red-light scene: CPU seconds per simulated second"
        )

    @property
    @override
    def peer(self) -> str:
        return "as many runs of the same scenario with one ego vehicle, measured beside it"

    @override
    def cases(self) -> Mapping[str, Case]:
        return {_name(count): EgosRun(count=count) for count in _COUNTS}

    @override
    def rows(self, measured: Mapping[str, Sequence[Measurement]]) -> Sequence[Row]:
        return list(_rows(measured))


def _name(count: int) -> str:
    return f"{count} ego{'s' if count > 1 else ''}"


def _rows(measured: Mapping[str, Sequence[Measurement]]) -> Iterator[Row]:
    spreads = {
        count: Spread.of(each["cpu_s"] for each in measured[_name(count)])
        for count in _COUNTS
        if _name(count) in measured
    }
    one = spreads.get(1)
    for count, spread in spreads.items():
        further = {}
        if one is not None and count > 1:
            further = {"each_further_s": (spread.median - one.median) / (count - 1)}
        yield Row.of(
            _name(count),
            spread,
            "CPU s/s",
            peer=None if one is None else count * one.median,
            peer_name="separate runs",
            is_higher_better=False,
            details=further,
        )
