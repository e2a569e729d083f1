"""From an experiment file to an `Experiment`: every problem at once, each at its place."""

import math
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import Any, Final

from orchestrator.blame import blamed
from orchestrator.campaign import loading
from orchestrator.errors import ComponentTypeError, ScenarioError
from orchestrator.experiment import skip
from orchestrator.experiment.hosting import Meeting, overlooked
from orchestrator.experiment.plan import Combination, Experiment, ReportPlan
from orchestrator.experiment.report import ExperimentReport, experiment_report_type
from orchestrator.experiment.schema import MAXIMUM_RUNS, ExperimentFile
from orchestrator.hosts_file import Hosts
from orchestrator.measure import defaults
from orchestrator.placement import placement
from orchestrator.run import no_line
from orchestrator.scenario.build import load_scenario
from orchestrator.scenario.document import Address
from orchestrator.scenario.model import Scenario
from orchestrator.scenario.outputs import repeated
from orchestrator.scenario.wiring import assemble

OWN_COLUMNS: Final = ("seed", "fingerprint", "wall_s", "cpu_s", "error", "n")
"""Columns that every table of results has."""

SIGNAL: Final = "signal"
"""The measure that metrics of signals are."""


def load_experiment(
    path: Path,
    transport: str | None = None,
    *,
    hosts: Hosts | None = None,
    tell: Callable[[str], None] = no_line,
) -> Experiment:
    """Read and check an experiment file, and the scenario at every combination of levels.

    Args:
        path: of the file; the path of the scenario in it is relative to its folder.
        transport: of its runs, see `run_scenario`.
        hosts: likewise; components that are there are met.
        tell: is called with a line whenever hosts are waited for.

    Raises:
        ComponentTypeError: there is no such transport.
        ComponentError: a host is not there.
        ScenarioError: all problems, each at its place in the experiment or the scenario.
    """
    load = _Load.of(path, ExperimentFile, "experiment", "factors")
    with Meeting(hosts, tell) as meeting:
        return load.experiment(transport, meeting)


class _Load(loading.Load[ExperimentFile]):
    """One reading of an experiment file."""

    def experiment(self, transport: str | None, meeting: Meeting) -> Experiment:
        scenario = self.scenario_path(self.file.scenario)
        self._check_columns()
        self.source.check_paths(self._settings(), _reserved)
        self._check_size()
        self.source.stop_at_problems()
        for address, what, at_key in skip.problems(self._levels, self.file.skip):
            self.source.add(address, what, at_key=at_key)
        report = self._report()
        self.source.stop_at_problems()
        remarks: dict[str, None] = {}
        combinations = self._combinations(scenario, transport, meeting, remarks)
        self.source.stop_at_problems()
        experiment = replace(
            self._planned(scenario, combinations),
            transport=transport,
            hosts=None if meeting.hosts is None else meeting.hosts.path.absolute(),
            remarks=tuple(remarks),
        )
        if report is not None:
            with blamed(f"the report `{report.__name__}`, asked what is wrong,"):
                for problem in report().check(experiment):
                    address = ("report", "parameters", *problem.address)
                    self.source.add(address, problem.what, at_key=problem.at_key)
        self.source.stop_at_problems()
        return experiment

    def _planned(self, scenario: Path, combinations: Sequence[Combination]) -> Experiment:
        chosen = self.file.report
        return Experiment(
            path=self.path,
            scenario=scenario,
            seeds=self.file.seeds,
            combinations=tuple(combinations),
            metrics=self._paths,
            report=None
            if chosen is None
            else ReportPlan(name=chosen.type, parameters=chosen.parameters),
            document=self.source.document,
        )

    @property
    def _levels(self) -> skip.Factors:
        return {factor: list(levels) for factor, levels in self.file.factors.items()}

    def _report(self) -> type[ExperimentReport] | None:
        if self.file.report is None:
            return None
        try:
            return experiment_report_type(self.file.report.type)
        except ComponentTypeError as error:
            self.source.add(("report", "type"), str(error))
            return None

    def _check_columns(self) -> None:
        """Factors and metrics share the columns of one table."""
        taken = dict.fromkeys(OWN_COLUMNS, "every table of results")
        for name in self.file.factors:
            if name in taken:
                what = f"`{name}` is a column of {taken[name]}; choose another name"
                self.source.add(("factors", name), what, at_key=True)
            taken.setdefault(name, f"the factor `{name}`")
        for name in self.file.metrics:
            columns = [name, f"{name}_n", f"{name}_low", f"{name}_high"]
            clash = next((column for column in columns if column in taken), None)
            if clash is not None:
                what = f"`{clash}` is a column of {taken[clash]}; choose another name"
                self.source.add(("metrics", name), what, at_key=True)
            taken |= dict.fromkeys(columns, f"the metric `{name}`")

    def _settings(self) -> Iterator[tuple[str, Address]]:
        """Every path that is set: who sets it, and its address."""
        for path in self.file.fixed:
            yield "`set`", ("set", path)
        yield from self.factors.settings()

    def _check_size(self) -> None:
        runs = math.prod(map(len, self.file.factors.values())) * len(self.file.seeds)
        if runs > MAXIMUM_RUNS:
            what = f"{runs} runs (levels times seeds) are more than {MAXIMUM_RUNS}"
            self.source.add(("factors",), what, at_key=True)

    def _combinations(
        self, scenario: Path, transport: str | None, meeting: Meeting, remarks: dict[str, None]
    ) -> list[Combination]:
        """All that are sound; problems with the others."""
        fixed = self.source.overrides(self.file.fixed, ("set",))
        found = []
        for levels in skip.combinations(self._levels, self.file.skip):
            overrides = (*fixed, *self.factors.overrides(levels))
            with self.factors.loading(levels):
                loaded = load_scenario(scenario, overrides)
                self._check_names(loaded.measures or {})
                asked = (*self._of_signals, *(self._named if loaded.measures is None else ()))
                if asked:
                    overrides = (*overrides, *asked)
                    loaded = load_scenario(scenario, overrides)
                if meeting.hosts is None:
                    remarks |= dict.fromkeys(overlooked(loaded))
                resolved = self._resolved(loaded, transport, meeting)
                found.append(Combination(levels, overrides, resolved))
        return found

    @cached_property
    def _paths(self) -> Mapping[str, str]:
        """The path of every metric."""
        return {
            name: said if isinstance(said, str) else f"measures.{name}.value"
            for name, said in self.file.metrics.items()
        }

    @cached_property
    def _of_signals(self) -> tuple[str, ...]:
        """What asks for the metrics that are numbers of signals: each is a measure of its name."""
        found = []
        for name, said in self.file.metrics.items():
            if isinstance(said, dict):
                at = ("metrics", name)
                found.append(self.source.override(f"measures.{name}.type", SIGNAL, at))
                for key, value in said.items():
                    found.append(self.source.override(f"measures.{name}.{key}", value, (*at, key)))
        return tuple(found)

    def _check_names(self, measures: Collection[str]) -> None:
        """A metric of a signal has a name that no measure of the scenario has."""
        for name, said in self.file.metrics.items():
            if isinstance(said, dict) and name in measures:
                what = f"the scenario has a measure `{name}`; choose another name"
                self.source.add(("metrics", name), what, at_key=True)

    @cached_property
    def _named(self) -> tuple[str, ...]:
        """What asks those installed measures that metrics name, for scenarios that ask none."""
        paths = [said.split(".") for said in self.file.metrics.values() if isinstance(said, str)]
        names = [p[1] for p in paths if len(p) == 3 and p[0] == "measures" and p[1] in defaults()]
        return tuple(f"measures.{name}={{}}" for name in dict.fromkeys(names))

    def _resolved(
        self, scenario: Scenario, transport: str | None, meeting: Meeting
    ) -> Mapping[str, Any]:
        """The scenario without its seed, if its components fit together."""
        placement(transport, scenario, meeting.hosts)
        assemble(scenario, meeting.place(scenario)).close()
        if scenario.report is None and not scenario.measures:
            what = "the scenario names no `report` and no `measures`: its runs have no metrics"
            self.source.add(("scenario",), what)
        if problems := list(repeated(scenario.document, scenario.components)):
            raise ScenarioError(problems)
        return loading.resolved(scenario)


def _reserved(keys: tuple[str, ...]) -> str:
    return "the seeds are those of `seeds`" if keys == ("seed",) else ""
