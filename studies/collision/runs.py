"""The runs of all experiments of the campaign, and the files that carry them to its page."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from orchestrator.experiment.report import Results, Row
from orchestrator.experiment.tables import TIMES
from studies.collision.conditions import (
    BY_FEATURES,
    CONSTANT,
    COOPERATIVE,
    SIMULATED,
    USUAL_AGE,
    Condition,
    condition_of,
)
from studies.method import records

METRICS: Final = {
    "collision": "collision",
    "collision_time": "collision_time",
    "collision_partner": "collision_partner",
    "success": "success",
    "completion_time": "completion_time",
    "prr": "prr.end_to_end",
    "direct_prr": "prr.direct",
    "begin": "session.begin",
    "served": "session.served",
    "relay_switches": "relay_switches",
    "min_gap_m": "min_gap_m",
}
"""Columns that an experiment needs, and the metrics of a run that they usually are."""

SUFFIX: Final = "_runs.csv"
"""The end of the name of the file of runs, after the name of the experiment."""

POLICIES: Final = "collision_policies"
CONSTANT_PER: Final = "collision_constant_per"
RELAY: Final = "collision_relay"
RADIO: Final = "collision_radio"
LOAD: Final = "collision_load"

EXPERIMENTS: Final[Mapping[str, str]] = {
    POLICIES: "driving policies under perfect communication",
    CONSTANT_PER: "constant packet error rates",
    "collision_speed": "constant packet error rates at 25 km/h",
    "collision_memory": "constant packet error rates for a policy that forgets",
    RELAY: "relay methods over the simulated channel",
    RADIO: "weaker radios",
    LOAD: "loads and loss granularities",
}
"""What is varied, by the name of the experiment file, which is that of the files of its report."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RunRow:
    """A run as its experiment recorded it: its condition, metrics, and whether it failed.

    The metrics are those of `METRICS`, `None` where there was nothing to measure.

    Attributes:
        condition: under which it was made.
        seed: the seed of the run.
        collision: whether the ego collided.
        collision_time: when it did [s].
        collision_partner: with what, as a role.
        success: whether the ego completed its way without a collision.
        completion_time: when it had completed its way [s].
        prr: packet reception rate of the sensor data end to end, 0 to 1.
        direct_prr: packet reception rate of the direct link, 0 to 1.
        begin: when fusion was first triggered [s].
        served: messages that reached the ego whole, per scan since then.
        relay_switches: number of changes of the relay.
        min_gap_m: the smallest distance to the collision vehicle [m].
        wall_s: the wall time of the run [s].
        error: why it failed; `None` if it did not.
        cpu_s: the processor time of the run [s]; `None` if it was not noted.
    """

    condition: Condition
    seed: int
    collision: bool | None
    collision_time: float | None
    collision_partner: str | None
    success: bool | None
    completion_time: float | None
    prr: float | None
    direct_prr: float | None
    begin: float | None
    served: float | None
    relay_switches: int | None
    min_gap_m: float | None
    wall_s: float
    error: str | None
    cpu_s: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Run:
    """What happened in a run that did not fail.

    Attributes:
        seed: the seed of the run.
        collision: whether the ego collided.
        partner: with what, as a role; empty without a collision.
        success: whether the ego completed its way without a collision.
        completion_time: when it had [s]; `None` if it did not complete.
        per: packet error rate of the sensor data end to end; `None` if none was sent.
        begin: when fusion was first triggered [s]; `None` if it never was.
        served: messages that reached the ego whole, per scan since fusion was first triggered;
            `None` if it never was.
    """

    seed: int
    collision: bool
    partner: str
    success: bool
    completion_time: float | None
    per: float | None
    begin: float | None
    served: float | None

    @staticmethod
    def of(row: RunRow) -> "Run":
        """The run of `row`, which did not fail."""
        return Run(
            seed=row.seed,
            collision=bool(row.collision),
            partner=row.collision_partner or "",
            success=bool(row.success),
            completion_time=row.completion_time,
            per=None if row.prr is None else 1.0 - row.prr,
            begin=row.begin,
            served=row.served,
        )


@dataclass(frozen=True, slots=True)
class Point:
    """The runs under one condition of one experiment.

    Attributes:
        experiment: the name of the experiment.
        condition: the condition of all runs.
        runs: those that did not fail, by seed.
    """

    experiment: str
    condition: Condition
    runs: Mapping[int, Run]

    @property
    def ordered(self) -> list[Run]:
        """The runs in the order of their seeds."""
        return [self.runs[seed] for seed in sorted(self.runs)]


def run_rows(results: Results, policy: str) -> list[RunRow]:
    """Every run of an experiment.

    Args:
        results: what the experiment found.
        policy: the name of the driving policy if no factor is.
    """
    names = ("seed", *METRICS, *TIMES, "error")
    return [
        RunRow(condition=condition, **{name: row[name] for name in names})
        for condition, row in with_conditions(results, policy)
    ]


def with_conditions(results: Results, policy: str) -> list[tuple[Condition, Row]]:
    """Every run of an experiment as a row of its table, with the condition it was made under.

    Args:
        results: what the experiment found.
        policy: the name of the driving policy if no factor is.
    """
    conditions = {
        tuple(each.levels.values()): condition_of(each.levels, each.resolved, policy)
        for each in results.experiment.combinations
    }
    factors = results.experiment.factors
    return [(conditions[tuple(row[factor] for factor in factors)], row) for row in results.rows]


def points(experiment: str, rows: Sequence[RunRow]) -> list[Point]:
    """The runs that did not fail, by condition, in the order of the experiment."""
    found: dict[Condition, dict[int, Run]] = {}
    for row in rows:
        runs = found.setdefault(row.condition, {})
        if row.error is None:
            runs[row.seed] = Run.of(row)
    return [Point(experiment, condition, runs) for condition, runs in found.items()]


def read(folder: Path, experiment: str) -> list[RunRow]:
    """The runs that a report wrote to `folder`.

    Raises:
        FileNotFoundError: the experiment was not run.
        ValueError: a cell is not what it should be; names the file and its line.
    """
    return records.read(folder / f"{experiment}{SUFFIX}", RunRow)


@dataclass(frozen=True, slots=True)
class Campaign:
    """What was run of all experiments.

    Attributes:
        points: the runs of all experiments, by condition.
        missing: experiments that were not run.
    """

    points: Sequence[Point]
    missing: Sequence[str]

    @staticmethod
    def read(folder: Path, experiments: Collection[str] = EXPERIMENTS) -> "Campaign":
        """Whatever of the experiments the reports wrote to `folder`.

        Raises:
            FileNotFoundError: there is nothing of any experiment.
            ValueError: a file is not what a report wrote.
        """
        missing = [name for name in experiments if not (folder / f"{name}{SUFFIX}").is_file()]
        if len(missing) == len(experiments):
            raise FileNotFoundError(2, "nothing", str(folder / f"{missing[0]}{SUFFIX}"))
        there = [name for name in experiments if name not in missing]
        found = [point for name in there for point in points(name, read(folder, name))]
        return Campaign(found, missing)

    def perfect(self, policy: str, compression: int | None = None) -> Point | None:
        """A policy that gets every packet, at the speed of most runs."""
        return self._find(policy=policy, compression=compression, channel=CONSTANT, per=0.0)

    def relayed(
        self,
        relay: str,
        compression: int | None,
        speed_kmh: float,
        policy: str = COOPERATIVE,
    ) -> Point | None:
        """A policy over the simulated channel, with a compression if it drives by features."""
        wanted = {"policy": policy, "channel": SIMULATED, "relay": relay}
        return self._find(**wanted, compression=compression, speed_kmh=speed_kmh)

    def _find(self, **wanted: Any) -> Point | None:
        """The one with the most runs; loads and what a policy remembers are as usual."""
        found = [
            point
            for point in self.points
            if all(getattr(point.condition, name) == value for name, value in wanted.items())
            and (point.condition.policy not in BY_FEATURES or point.condition.is_usual)
            and point.condition.maximum_age in (None, USUAL_AGE)
            and point.runs
        ]
        return max(found, key=lambda point: len(point.runs), default=None)
