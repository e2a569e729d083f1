"""The report `collision-study` of one experiment of the driving campaign.

NAME is that of the experiment file, e.g. `collision_relay`:

NAME.csv               per condition: collisions, successes, times, packet error rate
NAME_runs.csv          every run: condition, seed, metrics; what the page of all is made of
NAME_provenance.json   commands, commits, machine, versions, cost
"""

from collections.abc import Iterator, Mapping, Sequence
from itertools import combinations
from pathlib import Path
from typing import Any, Final

from typing_extensions import override

from orchestrator.experiment.plan import Experiment
from orchestrator.experiment.report import (
    ExperimentFindings,
    ExperimentReport,
    Results,
)
from orchestrator.parameters import ParameterProblem
from orchestrator.recording.layout import write_json
from orchestrator.suggestion import suggestion
from studies.collision import rates
from studies.collision.condition import COOPERATIVE, POLICY, condition_of
from studies.collision.runs import METRICS, SUFFIX, points, table
from studies.method import csv_file
from studies.method.origin import origin
from studies.method.text import columns_of_text, interval

PROVENANCE: Final = "_provenance.json"


class CollisionStudy(ExperimentReport):
    """Collisions under every condition of an experiment.

    Needs the metrics `METRICS`. The condition of a run is read from its scenario (relay,
    compression, speed, channel, load, granularity, maximum age, transmit power); the driving policy
    is the level of the factor `policy`, or without one the parameter `policy` (by default
    `cooperative`).
    """

    @override
    def check(self, experiment: Experiment) -> Iterator[ParameterProblem]:
        found = list(_parameter_problems(experiment))
        yield from found
        missing = [f"`{name}: {path}`" for name, path in METRICS.items()]
        missing = [
            text
            for text, name in zip(missing, METRICS, strict=True)
            if name not in experiment.metrics
        ]
        if missing:
            what = f"the collision study needs the metric {' and '.join(missing)}"
            yield ParameterProblem((), what)
        if not found:
            yield from _condition_problems(experiment)

    @override
    def write(self, results: Results, directory: Path) -> ExperimentFindings:
        name = results.experiment.path.stem
        runs = table(results, _policy(results.experiment))
        found = rates.rows(points(name, runs))
        csv_file.write(directory / f"{name}.csv", found)
        csv_file.write(directory / f"{name}{SUFFIX}", runs)
        write_json(directory / f"{name}{PROVENANCE}", origin(results))
        return ExperimentFindings(tables={name: found}, text=_text(found))


def _policy(experiment: Experiment) -> str:
    assert experiment.report is not None  # noqa: S101 - this is its report
    return str(experiment.report.parameters.get(POLICY, COOPERATIVE))


def _parameter_problems(experiment: Experiment) -> Iterator[ParameterProblem]:
    assert experiment.report is not None  # noqa: S101 - this is its report
    for name, value in experiment.report.parameters.items():
        if name != POLICY:
            what = f"there is no parameter `{name}`; {suggestion(name, [POLICY])}"
            yield ParameterProblem((name,), what, at_key=True)
        elif not isinstance(value, str) or not value:
            what = f"expected the name of a policy, e.g. `{COOPERATIVE}`"
            yield ParameterProblem((name,), what)
        elif POLICY in experiment.factors:
            what = f"the factor `{POLICY}` says which policy it is; leave the parameter out"
            yield ParameterProblem((name,), what, at_key=True)


def _condition_problems(experiment: Experiment) -> Iterator[ParameterProblem]:
    """Conditions that cannot be told from the scenario, or not from each other."""
    try:
        found = [
            (each.levels, condition_of(each.levels, each.resolved, _policy(experiment)))
            for each in experiment.combinations
        ]
    except ValueError as error:
        yield ParameterProblem((), str(error))
        return
    for (first, a), (second, b) in combinations(found, 2):
        if a == b:
            yield ParameterProblem(
                (),
                f"the combinations ({_named(first)}) and ({_named(second)}) are the same condition "
                f"for the collision study, which tells apart {', '.join(a.__dataclass_fields__)}",
            )
            return


def _named(levels: Mapping[str, str]) -> str:
    return ", ".join(f"{factor} {level}" for factor, level in levels.items())


def _text(found: Sequence[Mapping[str, Any]]) -> str:
    """The table for the terminal."""
    head = [
        "policy",
        "relay",
        "compression",
        "km/h",
        "load",
        "uses [s]",
        "dBm",
        "PER",
        "runs",
        "collisions",
        "success",
    ]
    body = [
        [
            row["policy"],
            row["relay"],
            str(row["compression"] or "-"),
            f"{row['speed_kmh']:g}",
            " ".join(filter(None, (row["load"], row["granularity"]))) or "-",
            "-" if row["maximum_age"] is None else f"{row['maximum_age']:g}",
            "-" if row["transmit_power"] is None else f"{row['transmit_power']:g}",
            "-" if row["per"] is None else f"{100 * row['per']:.1f}",
            str(row["runs"]),
            interval({**row, "rate_low": row["low"], "rate_high": row["high"]}, "rate", ".1f", 100),
            interval(row, "success", ".1f", 100),
        ]
        for row in found
    ]
    return "\n".join(["Collisions (in %):", *columns_of_text([head, *body])])
