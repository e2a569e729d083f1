"""The files of the study: those of one experiment, and the table of all of them together.

The report `generalisation` writes, where NAME is that of the experiment file:

NAME.csv               per variation and policy: collisions, successes, times
NAME_runs.csv          every run: levels, seed, metrics; what the page of all is made of
NAME_provenance.json   commands, commits, machine, versions

`write_campaign` makes `generalisation.csv` of them, the table of all.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any, Final

from typing_extensions import override

from orchestrator.experiment.plan import Experiment
from orchestrator.experiment.report import ExperimentFindings, ExperimentReport, Results
from orchestrator.parameters import ParameterProblem
from orchestrator.recording.layout import write_json
from studies.generalisation.campaign import different, with_campaign
from studies.generalisation.runs import (
    ADDED,
    ENCOUNTERS,
    METRICS,
    POLICY,
    PREFIX,
    SUFFIX,
    VARIATION,
    Run,
    runs_of,
)
from studies.generalisation.statistics import Result, results
from studies.method import records
from studies.method.origin import origin
from studies.method.report import missing, parameters, unknown_parameters
from studies.method.text import columns_of_text, percent_shown

PROVENANCE: Final = "_provenance.json"
"""The end of the name of the file that says where numbers come from, after the experiment's."""

TABLE: Final = "generalisation.csv"
"""The table of all experiments."""

RED_LIGHT: Final = f"{PREFIX}red_light"
"""The experiment that the collision campaign has runs of."""

TRAINED: Final = "trained"
"""The parameter that says who was trained in what: by variation, levels of the factor `policy`."""


class Generalisation(ExperimentReport):
    """How policies drive in the variations of an encounter.

    Needs the factors `policy` and `variation` and the metrics `METRICS`. The parameter `trained`
    has, by variation, the policies that were trained in it.
    """

    @override
    def check(self, experiment: Experiment) -> Iterator[ParameterProblem]:
        yield from unknown_parameters(experiment, [TRAINED])
        study = "study of generalisation"
        factors = {name: name for name in (POLICY, VARIATION)}
        yield from missing(study, "factor", factors, experiment.factors)
        metrics = {name: f"{name}: {name}" for name in METRICS}
        yield from missing(study, "metric", metrics, experiment.metrics)
        if factors.keys() <= set(experiment.factors):
            yield from _trained_problems(experiment)

    @override
    def write(self, results: Results, directory: Path) -> ExperimentFindings:
        name = results.experiment.path.stem
        runs = runs_of(results, parameters(results.experiment).get(TRAINED, {}))
        found = _of(name, runs)
        table = records.rows(found)
        records.write(directory / f"{name}.csv", table)
        records.write(directory / f"{name}{SUFFIX}", records.rows(runs))
        write_json(directory / f"{name}{PROVENANCE}", asdict(origin(results)))
        return ExperimentFindings(tables={name: table}, text=_text(found))


def read_campaign(folder: Path) -> list[Result]:
    """The table of whatever the reports wrote to `folder`, made again of the runs.

    Raises:
        FileNotFoundError: there is nothing of any experiment.
        ValueError: a file is not what a report wrote.
    """
    names = [f"{PREFIX}{name}" for name in ENCOUNTERS]
    there = [name for name in names if (folder / f"{name}{SUFFIX}").is_file()]
    if not there:
        raise FileNotFoundError(2, "nothing", str(folder / f"{names[0]}{SUFFIX}"))
    return [row for name in there for row in _of(name, _runs(folder, name))]


def _runs(folder: Path, name: str) -> list[Run]:
    """The runs of an experiment, of those in files of their own, and of the campaign."""
    runs = records.read(folder / f"{name}{SUFFIX}", Run)
    for end in ADDED:
        path = folder / f"{name}{end}{SUFFIX}"
        if path.is_file():
            runs += records.read(path, Run)
    return with_campaign(folder, runs) if name == RED_LIGHT else runs


def left_out(folder: Path) -> Mapping[str, int]:
    """The policies whose runs of the collision campaign are not in the table; see `different`.

    Raises:
        ValueError: a file is not what a report wrote.
    """
    path = folder / f"{RED_LIGHT}{SUFFIX}"
    return different(folder, records.read(path, Run)) if path.is_file() else {}


def write_campaign(folder: Path) -> None:
    """Write the table of all experiments whose reports are in `folder`.

    Raises:
        FileNotFoundError: there is nothing of any experiment.
        ValueError: a file is not what a report wrote.
    """
    records.write(folder / TABLE, records.rows(read_campaign(folder)))


def _of(name: str, runs: Sequence[Run]) -> list[Result]:
    rest = name.removeprefix(PREFIX)
    for end in ADDED:
        rest = rest.removesuffix(end)
    return results(ENCOUNTERS.get(rest, rest), runs)


def _trained_problems(experiment: Experiment) -> Iterator[ParameterProblem]:
    given: Any = parameters(experiment).get(TRAINED, {})
    if not isinstance(given, Mapping) or not all(isinstance(v, list) for v in given.values()):
        what = "expected lists of policies by variation, e.g. `{as trained: [bev-32]}`"
        yield ParameterProblem((TRAINED,), what)
        return
    levels = {
        factor: {each.levels[factor] for each in experiment.combinations}
        for factor in (POLICY, VARIATION)
    }
    for variation, policies in given.items():
        if variation not in levels[VARIATION]:
            what = f"there is no variation `{variation}`"
            yield ParameterProblem((TRAINED, variation), what, at_key=True)
        for k, policy in enumerate(policies):
            if policy not in levels[POLICY]:
                yield ParameterProblem((TRAINED, variation, k), f"there is no policy `{policy}`")


def _text(found: Sequence[Result]) -> str:
    """The table for the terminal."""
    head = ("variation", "policy", "runs", "collisions", "success", "SCT")
    body = [
        [
            row.variation,
            row.policy,
            str(row.runs),
            percent_shown(row.rate),
            percent_shown(row.success),
            percent_shown(row.sct),
        ]
        for row in found
    ]
    return "\n".join(["Collisions, successes (in %):", *columns_of_text([head, *body])])
