"""The report `sharing-study`: what ways of sharing cost and bring, per combination of levels.

It writes, where NAME is that of the experiment file, e.g. `sharing_methods`:

NAME.csv               per combination: every metric with its interval
NAME_runs.csv          every run: levels, seed, metrics
NAME_provenance.json   commands, commits, machine, versions
"""

from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from typing import Final

from typing_extensions import override

from orchestrator.experiment import tables
from orchestrator.experiment.plan import Experiment
from orchestrator.experiment.report import ExperimentFindings, ExperimentReport, Results
from orchestrator.parameters import ParameterProblem
from orchestrator.recording.layout import write_json
from studies.method import records
from studies.method.origin import origin
from studies.method.report import missing, unknown_parameters

METHOD: Final = "method"
"""The factor whose levels are ways of sharing."""

SHARING: Final = "sharing_kbyte_s"
"""The metric of the bytes on the air, basic safety messages left out."""

RUNS: Final = "_runs.csv"
PROVENANCE: Final = "_provenance.json"
"""Ends of the names of files, after the experiment's."""

_OMITTED: Final = (*tables.TIMES, "fingerprint")


class SharingStudy(ExperimentReport):
    """Ways of sharing under every condition of an experiment.

    Needs the factor `method` and the metric `sharing_kbyte_s`; has no parameters.
    """

    @override
    def check(self, experiment: Experiment) -> Iterator[ParameterProblem]:
        yield from unknown_parameters(experiment, ())
        for noun, name, offers in (
            ("factor", METHOD, experiment.factors),
            ("metric", SHARING, tuple(experiment.metrics)),
        ):
            yield from missing("sharing study", noun, {name: name}, offers)

    @override
    def write(self, results: Results, directory: Path) -> ExperimentFindings:
        name = results.experiment.path.stem
        table = tables.summary(results.experiment, list(results.rows))
        runs = [{k: v for k, v in row.items() if k not in _OMITTED} for row in results.rows]
        records.write(directory / f"{name}.csv", table)
        records.write(directory / f"{name}{RUNS}", runs)
        write_json(directory / f"{name}{PROVENANCE}", asdict(origin(results)))
        text = f"{len(table)} conditions, {len(runs)} runs; tables in {name}.csv"
        return ExperimentFindings(tables={name: table}, text=text)
