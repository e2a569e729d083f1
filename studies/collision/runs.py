"""Runs as the study sees them, and the file that carries them from a report to the page."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final

from orchestrator.experiment.report import Results
from studies.collision.condition import Condition, condition_of
from studies.method import csv_file

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


@dataclass(frozen=True, slots=True, kw_only=True)
class Run:
    """What happened in a run that did not fail.

    Attributes:
        seed: of the run.
        collision: whether the ego collided.
        partner: with what, as a role; empty without a collision.
        success: whether the ego completed its way without a collision.
        completion_time: [s]; `None` if it did not complete.
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


@dataclass(frozen=True, slots=True)
class Point:
    """The runs under one condition of one experiment.

    Attributes:
        experiment: its name.
        condition: of all runs.
        runs: by seed.
    """

    experiment: str
    condition: Condition
    runs: Mapping[int, Run]


def table(results: Results, policy: str) -> list[dict[str, Any]]:
    """Every run: its condition, seed, metrics, wall time [s] and error."""
    conditions = {
        tuple(each.levels.values()): condition_of(each.levels, each.resolved, policy)
        for each in results.experiment.combinations
    }
    factors = results.experiment.factors
    names = ("seed", *METRICS, "wall_s", "error")
    return [
        {
            **asdict(conditions[tuple(row[factor] for factor in factors)]),
            **{name: row[name] for name in names},
        }
        for row in results.rows
    ]


def points(experiment: str, rows: Sequence[Mapping[str, Any]]) -> list[Point]:
    """The runs of `table` that did not fail, by condition, in the order of the experiment."""
    found: dict[Condition, dict[int, Run]] = {}
    for row in rows:
        runs = found.setdefault(_condition(row), {})
        if row["error"] is None:
            runs[row["seed"]] = _run(row)
    return [Point(experiment, condition, runs) for condition, runs in found.items()]


def read(folder: Path, experiment: str) -> list[Point]:
    """The runs that a report wrote to `folder`.

    Raises:
        FileNotFoundError: the experiment was not run.
        ValueError: a cell is not what it should be; names the file and its line.
    """
    path = folder / f"{experiment}{SUFFIX}"
    return points(experiment, list(_typed(path)))


def _typed(path: Path) -> Iterator[dict[str, Any]]:
    for line, row in enumerate(csv_file.read(path), start=2):
        try:
            yield {name: _KINDS[name](row[name]) for name in _KINDS}
        except KeyError as error:
            raise ValueError(f"{path}: there is no column {error}; run the report again") from None
        except ValueError as error:
            raise ValueError(f"{path}:{line}: {error}") from None


def _number(cell: str) -> float | None:
    return float(cell) if cell else None


def _truth(cell: str) -> bool | None:
    if cell not in ("True", "False", ""):
        raise ValueError(f"expected `True`, `False` or nothing, got `{cell}`")
    return None if not cell else cell == "True"


_KINDS: Final[Mapping[str, Callable[[str], Any]]] = {
    "policy": str,
    "relay": str,
    "compression": lambda cell: int(cell) if cell else None,
    "speed_kmh": float,
    "channel": str,
    "per": _number,
    "load": str,
    "granularity": str,
    "maximum_age": _number,
    "transmit_power": _number,
    "seed": int,
    "collision": _truth,
    "collision_partner": str,
    "success": _truth,
    "completion_time": _number,
    "prr": _number,
    "begin": _number,
    "served": _number,
    "error": lambda cell: cell or None,
}


def _condition(row: Mapping[str, Any]) -> Condition:
    return Condition(**{name: row[name] for name in Condition.__dataclass_fields__})


def _run(row: Mapping[str, Any]) -> Run:
    return Run(
        seed=row["seed"],
        collision=bool(row["collision"]),
        partner=row["collision_partner"] or "",
        success=bool(row["success"]),
        completion_time=row["completion_time"],
        per=None if row["prr"] is None else 1.0 - row["prr"],
        begin=row["begin"],
        served=row["served"],
    )
