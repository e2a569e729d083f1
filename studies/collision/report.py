"""The files of the driving campaign: those of one experiment, and those of all of them together.

The report `collision-study` writes, where NAME is that of the experiment file, e.g.
`collision_relay`:

NAME.csv               per condition: collisions, successes, times, packet error rate
NAME_runs.csv          every run: condition, seed, metrics; what the page of all is made of
NAME_provenance.json   commands, commits, machine, versions

`write_campaign` makes of them:

collision.csv              per condition: collisions with intervals, and more
collision_claims.csv       the paper's claims and ours, with verdicts
collision_critical.csv     packet error rates at which the collision rate crosses 1, 10 and 50 %
collision_linearity.csv    how far the curves over constant rates are from straight lines
collision_assumption.csv   the simulated channel against a constant rate of the same mean
collision_partners.csv     with whom the ego collided
figure9_10.*               collision rate over packet error rate: points (CSV), picture (SVG, PNG)
collision_policies.svg     driving policies under perfect communication; and PNG
collision_radio.svg        weaker radios; and PNG
collision_load.svg         loads and loss granularities; and PNG
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict
from itertools import combinations
from pathlib import Path
from typing import Final, TypeVar

from typing_extensions import override

from orchestrator.experiment.plan import Experiment
from orchestrator.experiment.report import (
    ExperimentFindings,
    ExperimentReport,
    Results,
)
from orchestrator.parameters import ParameterProblem
from orchestrator.recording.layout import write_json
from studies.collision import statistics
from studies.collision.claims import claims
from studies.collision.conditions import COOPERATIVE, POLICY, condition_of
from studies.collision.curves import (
    Assumption,
    CriticalPoint,
    Linearity,
    assumptions,
    critical_points,
    curves,
    linearities,
)
from studies.collision.runs import (
    CONSTANT_PER,
    LOAD,
    METRICS,
    POLICIES,
    RADIO,
    SUFFIX,
    Campaign,
    points,
    run_rows,
)
from studies.collision.statistics import Partner, Result, beside_relay, partners
from studies.method import records
from studies.method.claims import Judgement, judge
from studies.method.origin import origin
from studies.method.report import missing, parameters, unknown_parameters
from studies.method.text import columns_of_text, percent_shown

PROVENANCE: Final = "_provenance.json"
"""The end of the name of the file that says where numbers come from, after the experiment's."""

FIGURE: Final = "figure9_10"
"""The name of the files of the figure of all experiments together."""

_TABLES: Final[Mapping[type, str]] = {
    Result: "collision",
    Judgement: "collision_claims",
    CriticalPoint: "collision_critical",
    Linearity: "collision_linearity",
    Assumption: "collision_assumption",
    Partner: "collision_partners",
}
"""The names of the tables of all experiments together, by the type of their rows."""

Row = TypeVar("Row")


def read_table(folder: Path, row: type[Row]) -> list[Row]:
    """The table of all experiments together with rows of this type, as `write_campaign` wrote it.

    Raises:
        FileNotFoundError: it did not.
        ValueError: a cell is not what it should be; names the file and its line.
    """
    return records.read(folder / f"{_TABLES[row]}.csv", row)


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
        needed = {name: f"{name}: {path}" for name, path in METRICS.items()}
        yield from missing("collision study", "metric", needed, experiment.metrics)
        if not found:
            yield from _condition_problems(experiment)

    @override
    def write(self, results: Results, directory: Path) -> ExperimentFindings:
        name = results.experiment.path.stem
        runs = run_rows(results, _policy(results.experiment))
        found = statistics.results(points(name, runs))
        table = records.rows(found)
        records.write(directory / f"{name}.csv", table)
        records.write(directory / f"{name}{SUFFIX}", records.rows(runs))
        write_json(directory / f"{name}{PROVENANCE}", asdict(origin(results)))
        return ExperimentFindings(tables={name: table}, text=_text(found))


def write_campaign(folder: Path) -> None:
    """Write tables and figures of the experiments whose reports are in `folder`.

    Pictures of nothing are left out.

    Raises:
        FileNotFoundError: there is nothing of any experiment.
        ValueError: a file is not what a report wrote.
    """
    campaign = Campaign.read(folder)
    table = statistics.results(campaign.points)
    on_curves = [point for each in curves(campaign.points).values() for point in each]
    over_per = statistics.results(on_curves)
    tables: dict[str, Sequence[object]] = {
        _TABLES[Result]: table,
        _TABLES[Judgement]: judge(claims(campaign)),
        _TABLES[CriticalPoint]: critical_points(campaign.points),
        _TABLES[Linearity]: linearities(campaign.points),
        _TABLES[Assumption]: assumptions(campaign.points),
        _TABLES[Partner]: partners(campaign.points),
        FIGURE: over_per,
    }
    for name, found in tables.items():
        records.write(folder / f"{name}.csv", records.rows(found))
    _draw(table, over_per, folder)


def _draw(table: Sequence[Result], over_per: Sequence[Result], folder: Path) -> None:
    from studies.collision import figures  # noqa: PLC0415 - matplotlib is slow

    if over_per:
        figures.draw_over_per(over_per, folder / FIGURE)
    if rows := [row for row in table if row.experiment == POLICIES]:
        figures.draw_policies(rows, folder / POLICIES)
    if rows := beside_relay(table, RADIO):
        constant = [row for row in table if row.experiment == CONSTANT_PER]
        figures.draw_radio(rows, constant, folder / RADIO)
    if rows := beside_relay(table, LOAD):
        figures.draw_load(rows, folder / LOAD)


def _policy(experiment: Experiment) -> str:
    return str(parameters(experiment).get(POLICY, COOPERATIVE))


def _parameter_problems(experiment: Experiment) -> Iterator[ParameterProblem]:
    yield from unknown_parameters(experiment, [POLICY])
    given = parameters(experiment)
    if POLICY not in given:
        return
    if not isinstance(given[POLICY], str) or not given[POLICY]:
        what = f"expected the name of a policy, e.g. `{COOPERATIVE}`"
        yield ParameterProblem((POLICY,), what)
    elif POLICY in experiment.factors:
        what = f"the factor `{POLICY}` says which policy it is; leave the parameter out"
        yield ParameterProblem((POLICY,), what, at_key=True)


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


def _text(found: Sequence[Result]) -> str:
    """The table for the terminal."""
    head = (
        "policy", "relay", "compression", "km/h", "load", "uses [s]", "dBm", "PER", "runs",
        "collisions", "success",
    )  # fmt: skip
    body = [
        [
            row.policy,
            row.relay,
            str(row.compression or "-"),
            f"{row.speed_kmh:g}",
            " ".join(filter(None, (row.load, row.granularity))) or "-",
            "-" if row.maximum_age is None else f"{row.maximum_age:g}",
            "-" if row.transmit_power is None else f"{row.transmit_power:g}",
            "-" if row.per is None else f"{100 * row.per:.1f}",
            str(row.runs),
            percent_shown(row.collision_rate),
            percent_shown(row.success),
        ]
        for row in found
    ]
    return "\n".join(["Collisions (in %):", *columns_of_text([head, *body])])
