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

from collections.abc import Iterator, Mapping
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
from studies.method import csv_file
from studies.method.text import columns_of_text, interval
from studies.relay import claims, density, distribution, pairs, table2
from studies.relay.provenance import provenance
from studies.relay.sample import METHOD, Condition, Study, condition_of

FACTORS: Final = (METHOD, density.FACTOR)
METRICS: Final = ("prr", "direct_prr", "relay_switches")
PROVENANCE: Final = "relay_provenance.json"


class RelayStudy(ExperimentReport):
    """The comparison of relay policies.

    Needs the factors `method` and `density`, and the metrics `prr`, `direct_prr` and
    `relay_switches`; `collision_rate` is tabulated if it is there. Levels of `method` that have the
    names of the paper's methods and ours (see `paper.TABLE_2`, `claims`) are compared with its
    numbers. The parameter `base` has, of every factor but `method`, the level of Table II.
    """

    @override
    def check(self, experiment: Experiment) -> Iterator[ParameterProblem]:
        for kind, needed, offers in (
            ("factor", FACTORS, experiment.factors),
            ("metric", METRICS, tuple(experiment.metrics)),
        ):
            missing = [f"`{name}`" for name in needed if name not in offers]
            if missing:
                what = f"the relay study needs the {kind} {' and '.join(missing)}"
                yield ParameterProblem((), what)
                return
        yield from _base_problems(experiment)
        for combination in experiment.combinations[:1]:
            try:
                density.vehicles_per_km(combination.resolved)
            except ValueError as error:
                yield ParameterProblem((), str(error))

    @override
    def write(self, results: Results, directory: Path) -> ExperimentFindings:
        study = Study(results, _base(results.experiment))
        tables: dict[str, list[dict[str, Any]]] = {
            "table2": table2.rows(study, study.base),
            "table2_all": table2.all_rows(study),
            "relay_differences": pairs.rows(study),
            "relay_claims": claims.rows(study),
            "figure7": density.rows(study),
        }
        for name, table in tables.items():
            csv_file.write(directory / f"{name}.csv", table)
        csv_file.write(directory / "figure8.csv", distribution.rows(study))
        csv_file.write(directory / "relay_runs.csv", _runs(results))
        write_json(directory / PROVENANCE, provenance(results, study.base))
        _draw(study, directory)
        return ExperimentFindings(tables=tables, text=_text(tables, study.base))


def _draw(study: Study, directory: Path) -> None:
    from studies.relay import figure7, figure8  # noqa: PLC0415 - matplotlib is slow

    figure7.draw(study, directory / "figure7")
    figure8.draw(study, directory / "figure8")


def _base(experiment: Experiment) -> Condition:
    """The condition of Table II; a factor with a single level need not be in `base`."""
    assert experiment.report is not None  # noqa: S101 - this is its report
    given: Mapping[str, str] = experiment.report.parameters.get("base", {})
    levels = condition_of({factor: all_[0] for factor, all_ in experiment.levels.items()})
    return {**levels, **given}


def _base_problems(experiment: Experiment) -> Iterator[ParameterProblem]:
    assert experiment.report is not None  # noqa: S101 - this is its report
    parameters = experiment.report.parameters
    for name in parameters:
        if name != "base":
            what = f"there is no parameter `{name}`; {suggestion(name, ['base'])}"
            yield ParameterProblem((name,), what, at_key=True)
    base = parameters.get("base", {})
    if not isinstance(base, dict):
        what = "expected a mapping from factors to levels, e.g. `{density: 30 m}`"
        yield ParameterProblem(("base",), what)
        return
    found = list(_level_problems(experiment, base))
    yield from found
    if not found and not any(
        condition_of(each.levels) == _base(experiment) for each in experiment.combinations
    ):
        what = "no combination at these levels is left by `skip`"
        yield ParameterProblem(("base",), what)


def _level_problems(experiment: Experiment, base: Mapping[str, Any]) -> Iterator[ParameterProblem]:
    wanted = {f: levels for f, levels in experiment.levels.items() if f != METHOD}
    for factor, level in base.items():
        if factor not in wanted:
            what = f"there is no factor `{factor}` besides `{METHOD}`; {suggestion(factor, wanted)}"
            yield ParameterProblem(("base", factor), what, at_key=True)
        elif level not in wanted[factor]:
            hint = suggestion(str(level), wanted[factor])
            what = f"the factor `{factor}` has no level `{level}` that is run; {hint}"
            yield ParameterProblem(("base", factor), what)
    for factor, levels in wanted.items():
        if factor not in base and len(levels) > 1:
            what = f"which level of `{factor}` is that of Table II? There are: {', '.join(levels)}"
            yield ParameterProblem(("base",), what)


def _runs(results: Results) -> list[dict[str, Any]]:
    """Every run: levels, seed, metrics, wall time, error; less than `runs.parquet` has."""
    names = (*results.experiment.factors, "seed", *results.experiment.metrics, "wall_s", "error")
    return [{name: row[name] for name in names} for row in results.rows]


def _text(tables: Mapping[str, list[dict[str, Any]]], base: Condition) -> str:
    """Table II and the verdicts for the terminal."""
    where = ", ".join(f"{factor} {level}" for factor, level in base.items())
    head = [METHOD, "n", "PRR", "paper", "relay switches", "paper", "regret"]
    body = [
        [
            row[METHOD],
            str(row["n"]),
            interval(row, "prr", ".1f", scale=100.0),
            "-" if row["paper_prr"] is None else f"{100 * row['paper_prr']:.1f}",
            interval(row, "relay_switches", ".2f"),
            "-" if row["paper_relay_switches"] is None else f"{row['paper_relay_switches']:.2f}",
            interval(row, "regret", ".1f", scale=100.0),
        ]
        for row in tables["table2"]
    ]
    verdicts = dict.fromkeys((row["verdict"], row["text"]) for row in tables["relay_claims"])
    lines = [f"Table II ({where}), in %:", *columns_of_text([head, *body]), "", "claims:"]
    return "\n".join([*lines, *(f"  {verdict}: {text}" for verdict, text in verdicts)])
