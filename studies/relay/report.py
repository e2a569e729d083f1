"""The report `relay-study` of experiments: tables, figures, claims, and where they come from.

table2.csv              per method at the base condition, beside the paper's Table II
table2_all.csv          the same at every condition
relay_differences.csv   pairs of methods, by the same seeds
relay_claims.csv        the paper's claims and ours, with verdicts
figure7.*               packet reception rate over density: points (CSV), picture (SVG, PNG)
figure8.*               distribution of the packet reception rate over runs: steps, picture
relay_runs.csv          every run: levels, seed, metrics
relay_provenance.json   commands, commits, machine, versions, cost
"""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Final

from typing_extensions import override

from orchestrator.experiment.plan import Experiment
from orchestrator.experiment.report import (
    ExperimentFindings,
    ExperimentReport,
    Results,
    Row,
)
from orchestrator.parameters import ParameterProblem
from orchestrator.suggestion import suggestion
from studies.method import records
from studies.method.claims import Judgement, judge
from studies.method.report import missing, parameters, unknown_parameters
from studies.method.text import columns_of_text, percent_shown, shown
from studies.relay import statistics
from studies.relay.claims import claims
from studies.relay.conditions import (
    DENSITY,
    METHOD,
    Condition,
    condition_of,
    vehicles_per_km,
)
from studies.relay.provenance import Provenance
from studies.relay.runs import Study
from studies.relay.statistics import DensityPoint, Result, Step

FACTORS: Final = (METHOD, DENSITY)
METRICS: Final = ("prr", "direct_prr", "relay_switches")
BASE: Final = "base"
"""The parameter that says which condition is that of Table II."""

PROVENANCE: Final = "relay_provenance.json"

_PAPER: Final = ("paper_prr", "paper_relay_switches")
_COLLISIONS: Final = ("collision_rate", "collision_rate_low", "collision_rate_high")
"""Columns of results that not every table has."""


class RelayStudy(ExperimentReport):
    """The comparison of relay policies.

    Needs the factors `method` and `density`, and the metrics `prr`, `direct_prr` and
    `relay_switches`; `collision_rate` is tabulated if it is there. Levels of `method` that have the
    names of the paper's methods and ours (see `published.TABLE_2`, `claims`) are compared with its
    numbers. The parameter `base` has, of every factor but `method`, the level of Table II.
    """

    @override
    def check(self, experiment: Experiment) -> Iterator[ParameterProblem]:
        for kind, needed, offers in (
            ("factor", FACTORS, experiment.factors),
            ("metric", METRICS, tuple(experiment.metrics)),
        ):
            lacking = list(missing("relay study", kind, {name: name for name in needed}, offers))
            yield from lacking
            if lacking:
                return
        yield from _base_problems(experiment)
        for combination in experiment.combinations[:1]:
            try:
                vehicles_per_km(combination.resolved)
            except ValueError as error:
                yield ParameterProblem((), str(error))

    @override
    def write(self, results: Results, directory: Path) -> ExperimentFindings:
        study = Study(results, _base(results.experiment))
        found = statistics.results(study, [study.base])
        judgements = judge(claims(study))
        points, steps = statistics.density_points(study), statistics.steps(study)
        absent = () if "collision_rate" in results.experiment.metrics else _COLLISIONS
        everywhere = statistics.results(study, study.conditions)
        tables = {
            "table2": records.rows(found, without=(*study.base, *absent)),
            "table2_all": records.rows(everywhere, without=(*_PAPER, *absent)),
            "relay_differences": records.rows(statistics.pairs(study)),
            "relay_claims": records.rows(judgements),
            "figure7": records.rows(points),
        }
        for name, table in tables.items():
            records.write(directory / f"{name}.csv", table)
        records.write(directory / "figure8.csv", records.rows(steps))
        records.write(directory / "relay_runs.csv", _runs(results))
        Provenance.of(results, study.base).write(directory / PROVENANCE)
        _draw(points, steps, directory)
        return ExperimentFindings(tables=tables, text=_text(found, judgements, study.base))


def _draw(points: Sequence[DensityPoint], steps: Sequence[Step], directory: Path) -> None:
    from studies.relay import figures  # noqa: PLC0415 - matplotlib is slow

    figures.draw_density(points, directory / "figure7")
    figures.draw_distribution(steps, directory / "figure8")


def _base(experiment: Experiment) -> Condition:
    """The condition of Table II; a factor with a single level need not be in `base`."""
    given: Mapping[str, str] = parameters(experiment).get(BASE, {})
    levels = condition_of({factor: all_[0] for factor, all_ in experiment.levels.items()})
    return {**levels, **given}


def _base_problems(experiment: Experiment) -> Iterator[ParameterProblem]:
    yield from unknown_parameters(experiment, [BASE])
    base = parameters(experiment).get(BASE, {})
    if not isinstance(base, dict):
        what = "expected a mapping from factors to levels, e.g. `{density: 30 m}`"
        yield ParameterProblem((BASE,), what)
        return
    found = list(_level_problems(experiment, base))
    yield from found
    if not found and not any(
        condition_of(each.levels) == _base(experiment) for each in experiment.combinations
    ):
        what = "no combination at these levels is left by `skip`"
        yield ParameterProblem((BASE,), what)


def _level_problems(
    experiment: Experiment, base: Mapping[str, object]
) -> Iterator[ParameterProblem]:
    wanted = {f: levels for f, levels in experiment.levels.items() if f != METHOD}
    for factor, level in base.items():
        if factor not in wanted:
            what = f"there is no factor `{factor}` besides `{METHOD}`; {suggestion(factor, wanted)}"
            yield ParameterProblem((BASE, factor), what, at_key=True)
        elif level not in wanted[factor]:
            hint = suggestion(str(level), wanted[factor])
            what = f"the factor `{factor}` has no level `{level}` that is run; {hint}"
            yield ParameterProblem((BASE, factor), what)
    for factor, levels in wanted.items():
        if factor not in base and len(levels) > 1:
            what = f"which level of `{factor}` is that of Table II? There are: {', '.join(levels)}"
            yield ParameterProblem((BASE,), what)


def _runs(results: Results) -> list[Row]:
    """Every run: levels, seed, metrics, wall time, error; less than `runs.parquet` has."""
    names = (*results.experiment.factors, "seed", *results.experiment.metrics, "wall_s", "error")
    return [{name: row[name] for name in names} for row in results.rows]


def _text(found: Sequence[Result], judgements: Sequence[Judgement], base: Condition) -> str:
    """Table II and the verdicts for the terminal."""
    where = ", ".join(f"{factor} {level}" for factor, level in base.items())
    head = [METHOD, "n", "PRR", "paper", "relay switches", "paper", "regret"]
    body = [
        [
            row.method,
            str(row.n),
            percent_shown(row.prr),
            "-" if row.paper_prr is None else f"{100 * row.paper_prr:.1f}",
            shown(row.relay_switches, ".2f"),
            "-" if row.paper_relay_switches is None else f"{row.paper_relay_switches:.2f}",
            percent_shown(row.regret),
        ]
        for row in found
    ]
    verdicts = dict.fromkeys((one.verdict, one.text) for one in judgements)
    lines = [f"Table II ({where}), in %:", *columns_of_text([head, *body]), "", "claims:"]
    return "\n".join([*lines, *(f"  {verdict}: {text}" for verdict, text in verdicts)])
