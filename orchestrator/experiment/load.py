"""From an experiment file to an `Experiment`: every problem at once, each at its place."""

import json
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from pydantic import ValidationError

from orchestrator.errors import ComponentTypeError, Problem, ScenarioError
from orchestrator.experiment import skip
from orchestrator.experiment.plan import Combination, Experiment, ReportPlan
from orchestrator.experiment.report import ExperimentReport, experiment_report_type
from orchestrator.experiment.schema import MAXIMUM_RUNS, ExperimentFile
from orchestrator.scenario import diagnosis
from orchestrator.scenario.build import load_scenario
from orchestrator.scenario.document import Address, Document, Place
from orchestrator.scenario.model import Scenario
from orchestrator.scenario.overrides import Override
from orchestrator.scenario.wiring import assemble

OWN_COLUMNS: Final = ("seed", "fingerprint", "wall_s", "error", "n")
"""Columns that every table of results has."""


def load_experiment(path: Path) -> Experiment:
    """Read and check an experiment file, and the scenario at every combination of levels.

    Args:
        path: of the file; the path of the scenario in it is relative to its folder.

    Raises:
        ScenarioError: all problems, each at its place in the experiment or the scenario.
    """
    document = Document.read(path)
    try:
        file = ExperimentFile.model_validate(document.data)
    except ValidationError as error:
        found = diagnosis.problems(document, ExperimentFile, error, whole="the experiment")
        raise ScenarioError(sorted(found, key=lambda p: p.where)) from None
    return _Load(path, document, file).experiment()


@dataclass(slots=True)
class _Load:
    """One reading of an experiment file, collecting problems."""

    path: Path
    document: Document
    file: ExperimentFile
    problems: list[Problem] = field(default_factory=list)
    _places: dict[str, Place] = field(default_factory=dict)
    """Of each override, by the file name that its locations carry."""

    def experiment(self) -> Experiment:
        scenario = (self.path.parent / self.file.scenario).absolute()
        if not scenario.is_file():
            what = f"there is no file {scenario} (the path is relative to this file)"
            self._add(("scenario",), what)
        self._check_columns()
        self._check_paths()
        self._check_size()
        self._stop_at_problems()
        for address, what, at_key in skip.problems(self._factors, self.file.skip):
            self._add(address, what, at_key=at_key)
        report = self._report()
        self._stop_at_problems()
        combinations = self._combinations(scenario)
        self._stop_at_problems()
        experiment = self._planned(scenario, combinations)
        if report is not None:
            for problem in report().check(experiment):
                address = ("report", "parameters", *problem.address)
                self._add(address, problem.what, at_key=problem.at_key)
        self._stop_at_problems()
        return experiment

    def _planned(self, scenario: Path, combinations: Sequence[Combination]) -> Experiment:
        chosen = self.file.report
        return Experiment(
            path=self.path,
            scenario=scenario,
            seeds=self.file.seeds,
            combinations=tuple(combinations),
            metrics=self.file.metrics,
            report=None
            if chosen is None
            else ReportPlan(name=chosen.type, parameters=chosen.parameters),
            document=self.document,
        )

    @property
    def _factors(self) -> skip.Factors:
        return {factor: list(levels) for factor, levels in self.file.factors.items()}

    def _report(self) -> type[ExperimentReport] | None:
        if self.file.report is None:
            return None
        try:
            return experiment_report_type(self.file.report.type)
        except ComponentTypeError as error:
            self._add(("report", "type"), str(error))
            return None

    def _add(self, address: Address, what: str, *, at_key: bool = False) -> None:
        while address not in self.document.places:
            address = address[:-1]  # a short form was written, or nothing
        where = self.document.key(address) if at_key else self.document.value(address)
        self.problems.append(Problem(where, f"{diagnosis.spell(address)}: {what}"))

    def _stop_at_problems(self) -> None:
        if self.problems:
            raise ScenarioError(sorted(set(self.problems), key=lambda p: (p.where, p.what)))

    def _check_columns(self) -> None:
        """Factors and metrics share the columns of one table."""
        taken = dict.fromkeys(OWN_COLUMNS, "every table of results")
        for name in self.file.factors:
            if name in taken:
                what = f"`{name}` is a column of {taken[name]}; choose another name"
                self._add(("factors", name), what, at_key=True)
            taken.setdefault(name, f"the factor `{name}`")
        for name in self.file.metrics:
            columns = [name, f"{name}_n", f"{name}_low", f"{name}_high"]
            clash = next((column for column in columns if column in taken), None)
            if clash is not None:
                what = f"`{clash}` is a column of {taken[clash]}; choose another name"
                self._add(("metrics", name), what, at_key=True)
            taken |= dict.fromkeys(columns, f"the metric `{name}`")

    def _check_paths(self) -> None:
        """Each value is set in one place: by `set`, or by the levels of one factor."""
        owners: dict[tuple[str, ...], str] = {}
        for owner, address in self._settings():
            path = str(address[-1])
            keys = tuple(path.split("."))
            if path == "seed":
                self._add(address, "the seeds are those of `seeds`", at_key=True)
            if "=" in path or not all(keys):
                what = f"`{path}` is not a path; write keys with dots, e.g. `time.stop`"
                self._add(address, what, at_key=True)
            for other, known in owners.items():
                n = min(len(keys), len(other))
                if known != owner and keys[:n] == other[:n]:
                    self._add(address, f"{known} sets `{'.'.join(other)}`, too", at_key=True)
            owners.setdefault(keys, owner)

    def _settings(self) -> Iterator[tuple[str, Address]]:
        """Every path that is set: who sets it, and its address."""
        for path in self.file.fixed:
            yield "`set`", ("set", path)
        for factor, levels in self.file.factors.items():
            for level, settings in levels.items():
                for path in settings:
                    yield f"the factor `{factor}`", ("factors", factor, level, path)

    def _check_size(self) -> None:
        runs = math.prod(map(len, self.file.factors.values())) * len(self.file.seeds)
        if runs > MAXIMUM_RUNS:
            what = f"{runs} runs (levels times seeds) are more than {MAXIMUM_RUNS}"
            self._add(("factors",), what, at_key=True)

    def _combinations(self, scenario: Path) -> list[Combination]:
        """All that are sound; problems with the others."""
        fixed = self._overrides(self.file.fixed, ("set",))
        found = []
        for levels in skip.combinations(self._factors, self.file.skip):
            overrides = list(fixed)
            for factor, level in levels.items():
                settings = self.file.factors[factor][level]
                overrides += self._overrides(settings, ("factors", factor, level))
            try:
                resolved = self._resolved(load_scenario(scenario, overrides))
            except ScenarioError as error:
                self.problems += [self._placed(problem, levels) for problem in error.problems]
                continue
            found.append(Combination(levels, tuple(overrides), resolved))
        return found

    def _overrides(self, settings: Mapping[str, Any], address: Address) -> list[str]:
        texts = []
        for path, value in settings.items():
            text = f"{path}={json.dumps(value, ensure_ascii=False)}"
            self._places[Override(text).file] = self.document.places[(*address, path)]
            texts.append(text)
        return texts

    def _resolved(self, scenario: Scenario) -> Mapping[str, Any]:
        """The scenario without its seed, if its components fit together."""
        assemble(scenario).close()
        if scenario.report is None:
            what = "the scenario names no `report`, thus its runs have no metrics"
            self._add(("scenario",), what)
        resolved = scenario.resolved()
        del resolved["seed"]
        return resolved

    def _placed(self, problem: Problem, levels: Mapping[str, str]) -> Problem:
        """A problem of an override, at the setting that makes it."""
        place = self._places.get(problem.where.file)
        if place is None:
            named = ", ".join(f"{factor} {level}" for factor, level in levels.items())
            return Problem(problem.where, problem.what + (f" (with {named})" if named else ""))
        text = problem.where.file.removeprefix("--set ")
        is_key = problem.where.column <= text.index("=")
        return Problem(place.key if is_key else place.value, problem.what)
