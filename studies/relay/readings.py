"""The report `relay-readings`: Table II under other readings, and maps of where MoHeD is better.

NAME is that of the experiment file.

NAME_runs.csv         every run: levels, seed, metrics
NAME_provenance.json  commands, commits, machine, versions, cost
NAME.csv, .svg, .png  with the parameter `map`: by how much the first method beats the second, cell
                      by cell
NAME_margins.csv      the same at each level of each of the two factors, and how that changes
"""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Final

from typing_extensions import override

from orchestrator.experiment.plan import Experiment
from orchestrator.experiment.report import ExperimentFindings, ExperimentReport, Results
from orchestrator.parameters import ParameterProblem
from orchestrator.suggestion import suggestion
from studies.method import records
from studies.method.report import missing, parameters, unknown_parameters
from studies.relay.advantage import Cell, Map, cells, margins
from studies.relay.conditions import METHOD
from studies.relay.provenance import Provenance

MAP: Final = "map"
"""The parameter that asks for a map."""

MARGINS: Final = "_margins"
"""The end of the name of the table by level, after the name of the experiment."""

METRICS: Final = ("prr", "direct_prr", "relay_switches")
_AXES: Final = ("columns", "rows")
_METHODS: Final = ("better", "worse")


class RelayReadings(ExperimentReport):
    """Runs of relay policies under several readings.

    Needs the factor `method` and the metrics `prr`, `direct_prr` and `relay_switches`. The
    parameter `map` says which factors are its `columns` and `rows`, and which method is compared
    with which: `better` minus `worse`.
    """

    @override
    def check(self, experiment: Experiment) -> Iterator[ParameterProblem]:
        yield from unknown_parameters(experiment, [MAP])
        for noun, needed, offers in (
            ("factor", (METHOD,), experiment.factors),
            ("metric", METRICS, tuple(experiment.metrics)),
        ):
            for name in needed:
                yield from missing("relay readings", noun, {name: name}, offers)
        if MAP in parameters(experiment):
            yield from _map_problems(experiment)

    @override
    def write(self, results: Results, directory: Path) -> ExperimentFindings:
        name = results.experiment.path.stem
        columns = (*results.experiment.factors, "seed", *results.experiment.metrics, "error")
        runs = [{column: row[column] for column in columns} for row in results.rows]
        records.write(directory / f"{name}_runs.csv", runs)
        Provenance.of(results, {}).write(directory / f"{name}_provenance.json")
        if MAP not in parameters(results.experiment):
            return ExperimentFindings(tables={}, text="")
        asked = Map(**parameters(results.experiment)[MAP])
        found = cells(asked, results)
        table = records.rows(found)
        records.write(directory / f"{name}.csv", table)
        by_level = records.rows(margins(asked, results))
        records.write(directory / f"{name}{MARGINS}.csv", by_level)
        _draw(asked, found, directory / name)
        return ExperimentFindings(tables={name: table}, text="")


def _draw(asked: Map, found: Sequence[Cell], path: Path) -> None:
    from studies.relay import heat_map  # noqa: PLC0415 - matplotlib is slow

    heat_map.draw(found, asked, path)


def _map_problems(experiment: Experiment) -> Iterator[ParameterProblem]:
    asked = parameters(experiment)[MAP]
    if not isinstance(asked, Mapping) or set(asked) != {*_AXES, *_METHODS}:
        what = f"expected a mapping with the keys {', '.join((*_AXES, *_METHODS))}"
        yield ParameterProblem((MAP,), what)
        return
    for keys, noun, offers in (
        (_AXES, "factor", [f for f in experiment.factors if f != METHOD]),
        (_METHODS, "method", experiment.levels.get(METHOD, ())),
    ):
        for key in keys:
            if asked[key] not in offers:
                what = f"there is no {noun} `{asked[key]}`; {suggestion(str(asked[key]), offers)}"
                yield ParameterProblem((MAP, key), what)
