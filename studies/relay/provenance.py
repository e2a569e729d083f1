"""Where the numbers of the relay study come from, and what every method costs."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from orchestrator.experiment.report import Results, Row
from orchestrator.recording.layout import write_json
from orchestrator.scenario.units import duration
from studies.method import records
from studies.method.origin import Origin, origin
from studies.relay.conditions import METHOD, Condition


@dataclass(frozen=True, slots=True, kw_only=True)
class Cost:
    """What the runs of a method cost.

    Start, simulation and metrics of a run are in it; workers have one thread each, so it is
    processor time as long as every worker has a core for itself.

    Attributes:
        method: the level of the factor `method`, or `all`.
        runs: the number of runs that did not fail.
        wall_s: wall time of the worker processes [s].
        simulated_s: simulated time [s].
        wall_s_per_simulated_s: the one over the other; `None` without runs.
    """

    method: str
    runs: int
    wall_s: float
    simulated_s: float
    wall_s_per_simulated_s: float | None


@dataclass(frozen=True, slots=True, kw_only=True)
class Provenance:
    """Where the numbers of an experiment come from, and what every method cost.

    Attributes:
        origin: where they come from.
        base: the condition of Table II; empty where there is none.
        cost: the cost of every method, and of all runs.
    """

    origin: Origin
    base: Condition
    cost: tuple[Cost, ...]

    @staticmethod
    def of(results: Results, base: Condition) -> "Provenance":
        """The provenance of `results`."""
        return Provenance(origin=origin(results), base=base, cost=_costs(results))

    @staticmethod
    def read(path: Path) -> "Provenance":
        """What was written to `path`.

        Raises:
            FileNotFoundError: there is no such file.
            ValueError: it does not say where numbers come from.
        """
        content = json.loads(path.read_text(encoding="utf-8"))
        costs = tuple(records.from_json(each, Cost) for each in content["cost"])
        found = records.from_json(content, Origin)
        return Provenance(origin=found, base=content["base"], cost=costs)

    def write(self, path: Path) -> None:
        """Write `path`: the fields of the origin, with `base` and `cost` among them."""
        experiment, *rest = asdict(self.origin).items()
        cost = [asdict(each) for each in self.cost]
        write_json(path, dict([experiment, ("base", dict(self.base)), *rest, ("cost", cost)]))


def _costs(results: Results) -> tuple[Cost, ...]:
    """The cost of every method, and of all runs."""
    simulated = {
        tuple(one.levels.values()): _simulated(one.resolved)
        for one in results.experiment.combinations
    }
    done = [row for row in results.rows if row["error"] is None]
    factors = results.experiment.factors

    def of(name: str, rows: Sequence[Row]) -> Cost:
        wall = sum(row["wall_s"] for row in rows)
        time = sum(simulated[tuple(row[f] for f in factors)] for row in rows)
        return Cost(
            method=name,
            runs=len(rows),
            wall_s=wall,
            simulated_s=time,
            wall_s_per_simulated_s=wall / time if time else None,
        )

    methods = results.experiment.levels[METHOD]
    each = [of(name, [row for row in done if row[METHOD] == name]) for name in methods]
    return (*each, of("all", done))


def _simulated(scenario: Mapping[str, Any]) -> float:
    """The simulated time of a run of a resolved scenario [s]."""
    time = scenario["time"]
    return (duration(time["stop"]) - duration(time["start"])) / 1e9
