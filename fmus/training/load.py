"""From a training file to a `Training`: every problem at once, each at its place."""

import contextlib
import itertools
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any, Final

from pydantic import ValidationError

from fmus.training.learner import (
    Learner,
    Optimisation,
    create_learner,
    declared_parameters,
    learner_type,
)
from fmus.training.parameters import converted
from fmus.training.plan import (
    BETA,
    COMPONENT,
    NETWORK,
    SAMPLE,
    Training,
    driver_texts,
    setting_texts,
)
from fmus.training.schema import MAXIMUM_RUNS, TrainingFile
from orchestrator.errors import ComponentTypeError, Problem, ScenarioError
from orchestrator.scenario import diagnosis
from orchestrator.scenario.build import load_scenario
from orchestrator.scenario.document import Address, Document, Place
from orchestrator.scenario.model import Scenario
from orchestrator.scenario.overrides import Override
from orchestrator.scenario.wiring import Assembly, assemble
from orchestrator.signal import Causality

TYPE: Final = "type"
"""The key of `network` that names the learner."""


def load_training(path: Path) -> Training:
    """Read and check a training file, and the scenario at every level of every factor.

    Args:
        path: of the file; paths in it are relative to its folder.

    Raises:
        ScenarioError: all problems, each at its place in the training file or the scenario.
    """
    document = Document.read(path)
    try:
        file = TrainingFile.model_validate(document.data)
    except ValidationError as error:
        found = diagnosis.problems(document, TrainingFile, error, whole="the training")
        raise ScenarioError(sorted(found, key=lambda p: p.where)) from None
    return _Load(path, document, file).training()


@dataclass(slots=True)
class _Load:
    """One reading of a training file, collecting problems."""

    path: Path
    document: Document
    file: TrainingFile
    problems: list[Problem] = field(default_factory=list)
    _places: dict[str, Place] = field(default_factory=dict)
    """Of each setting of a level, by the file name that its locations carry."""

    def training(self) -> Training:
        scenario = (self.path.parent / self.file.scenario).absolute()
        if not scenario.is_file():
            what = f"there is no file {scenario} (the path is relative to this file)"
            self._add(("scenario",), what)
        checkpoint = (self.path.parent / self.file.checkpoint).absolute()
        self._check_checkpoint(checkpoint)
        self._check_counts()
        self._check_paths()
        learner = self._learner()
        parameters = {} if learner is None else self._parameters(learner)
        self._stop_at_problems()
        assert learner is not None  # noqa: S101 - or there was a problem
        self._check_learner(learner, parameters)
        first = self._scenes(scenario)
        self._stop_at_problems()
        assert first is not None  # noqa: S101 - or there was a problem
        return self._planned(first, checkpoint, learner, parameters)

    def _planned(
        self,
        scenario: Scenario,
        checkpoint: Path,
        learner: type[Learner],
        parameters: Mapping[str, Any],
    ) -> Training:
        file = self.file
        resolved = scenario.resolved()
        del resolved["seed"]
        return Training(
            path=self.path,
            scenario=scenario.path,
            seed=file.seed,
            learner_name=file.network[TYPE],
            learner=learner,
            parameters=parameters,
            network=file.network,
            users=_users(scenario),
            scenes=file.scenes,
            expert_runs=file.expert.runs,
            validation_runs=file.validation.runs,
            drives=file.validation.drives,
            rounds=file.dagger.rounds,
            round_runs=file.dagger.runs,
            beta=file.dagger.beta,
            decay=file.dagger.decay,
            optimisation=self._optimisation,
            device=file.device,
            checkpoint=checkpoint,
            resolved=resolved,
        )

    @property
    def _optimisation(self) -> Optimisation:
        return Optimisation(**self.file.optimisation.model_dump())

    def _add(self, address: Address, what: str, *, at_key: bool = False) -> None:
        where = self.document.key(address) if at_key else self.document.value(address)
        self.problems.append(Problem(where, f"{diagnosis.spell(address)}: {what}"))

    def _stop_at_problems(self) -> None:
        if self.problems:
            raise ScenarioError(sorted(set(self.problems), key=lambda p: (p.where, p.what)))

    def _check_checkpoint(self, checkpoint: Path) -> None:
        if checkpoint.is_dir():
            self._add(("checkpoint",), f"{checkpoint} is a folder; write the name of a file")
        elif not checkpoint.parent.is_dir():
            self._add(("checkpoint",), f"there is no folder {checkpoint.parent}; create it")

    def _check_counts(self) -> None:
        file = self.file
        runs = file.expert.runs + file.dagger.rounds * file.dagger.runs
        if runs > MAXIMUM_RUNS:
            what = f"{runs} runs to learn from are more than {MAXIMUM_RUNS}"
            self._add(("dagger", "rounds"), what)
        if file.validation.drives > file.validation.runs:
            what = f"more than the {file.validation.runs} scenes of `validation.runs`"
            self._add(("validation", "drives"), what)

    def _check_paths(self) -> None:
        """Each value is set by the levels of one factor, and not if training sets it."""
        owners: dict[tuple[str, ...], str] = {}
        for factor, address in self._settings():
            path = str(address[-1])
            keys = tuple(path.split("."))
            if "=" in path or not all(keys):
                what = f"`{path}` is not a path; write keys with dots, e.g. `time.stop`"
                self._add(address, what, at_key=True)
            if reason := _reserved(keys):
                self._add(address, f"{reason}; remove it", at_key=True)
            for other, known in owners.items():
                n = min(len(keys), len(other))
                if known != factor and keys[:n] == other[:n]:
                    what = f"the factor `{known}` sets `{'.'.join(other)}`, too"
                    self._add(address, what, at_key=True)
            owners.setdefault(keys, factor)

    def _settings(self) -> Iterator[tuple[str, Address]]:
        """Every path that a level sets: its factor, and its address."""
        for factor, levels in self.file.scenes.items():
            for level, settings in levels.items():
                for path in settings:
                    yield factor, ("scenes", factor, level, path)

    def _learner(self) -> type[Learner] | None:
        name = self.file.network.get(TYPE)
        if not isinstance(name, str):
            at_key = name is None
            what = "`type` is missing" if at_key else f"expected text, got {diagnosis.show(name)}"
            self._add(("network",) if at_key else ("network", TYPE), what, at_key=at_key)
            return None
        try:
            return learner_type(name)
        except ComponentTypeError as error:
            is_absent = isinstance(error.__cause__, ImportError)
            hint = "; our learners need: pip install 'nlosim[train]'" if is_absent else ""
            self._add(("network", TYPE), f"{error}{hint}")
            return None

    def _parameters(self, learner: type[Learner]) -> Mapping[str, Any]:
        """The parameters of the learner, converted."""
        given = {name: value for name, value in self.file.network.items() if name != TYPE}
        found = converted(declared_parameters(learner), given, self.path.parent)
        for problem in found.problems:
            self._add(("network", *problem.address), problem.what, at_key=problem.at_key)
        return found.values

    def _check_learner(self, learner: type[Learner], parameters: Mapping[str, Any]) -> None:
        """Whether it can be created, before hours of driving."""
        try:
            create_learner(learner, parameters, self._optimisation, self.file.seed, "cpu")
        except (ValueError, ImportError) as error:
            self._add(("network",), str(error), at_key=True)

    def _scenes(self, scenario: Path) -> Scenario | None:
        """Load the scenario with every level once; the one with all first levels is returned."""
        first = {factor: next(iter(levels)) for factor, levels in self.file.scenes.items()}
        others = [
            {**first, factor: level}
            for factor, levels in self.file.scenes.items()
            for level in itertools.islice(levels, 1, None)
        ]
        found = self._scene(scenario, first)
        for levels in others:
            self._scene(scenario, levels)
        return found

    def _scene(self, path: Path, levels: Mapping[str, str]) -> Scenario | None:
        """The scenario, driven by the expert; problems of settings are problems of this file."""
        overrides = [
            text for factor, level in levels.items() for text in self._texts(factor, level)
        ]
        try:
            plain = load_scenario(path, overrides)
            if not self._is_trainable(plain):
                return None
            scenario = load_scenario(path, [*overrides, *driver_texts(_users(plain), None, 1.0)])
            with contextlib.closing(assemble(scenario)) as assembly:
                self._check_sample(scenario, assembly)
        except ScenarioError as error:
            self.problems += [self._placed(problem, levels) for problem in error.problems]
            return None
        return scenario

    def _texts(self, factor: str, level: str) -> list[str]:
        settings = self.file.scenes[factor][level]
        texts = list(setting_texts(settings))
        for path, text in zip(settings, texts, strict=True):
            place = self.document.places[("scenes", factor, level, path)]
            self._places[Override(text).file] = place
        return texts

    def _is_trainable(self, scenario: Scenario) -> bool:
        use = scenario.components.get(COMPONENT)
        if use is None:
            what = f"the scenario has no component `{COMPONENT}`, which training drives with"
            self._add(("scenario",), what)
            return False
        missing = [n for n in (NETWORK, BETA) if n not in use.type.parameters]
        if missing:
            named = " and ".join(f"`{name}`" for name in missing)
            what = f"`{COMPONENT}` of the scenario is of the type `{use.origin()}`, which has no "
            what += f"parameter {named}; training needs one that has, such as `policy-dagger`"
            self._add(("scenario",), what)
        return not missing

    def _check_sample(self, scenario: Scenario, assembly: Assembly) -> None:
        name = f"{COMPONENT}.{SAMPLE}"
        connector = assembly.system.connectors[COMPONENT].get(SAMPLE)
        if connector is None or connector.causality is not Causality.OUTPUT:
            self._add(("scenario",), f"there is no output `{name}`, which training learns from")
        elif not connector.is_binary:
            self._add(("scenario",), f"`{name}` is {connector.kind()}; training reads bytes")
        elif not _is_recorded(scenario, name):
            self._add(("scenario",), f"its `recording` leaves `{name}` out; include it")

    def _placed(self, problem: Problem, levels: Mapping[str, str]) -> Problem:
        """A problem of a setting, where it is written."""
        place = self._places.get(problem.where.file)
        if place is None:
            named = ", ".join(f"{factor} {level}" for factor, level in levels.items())
            return replace(problem, what=problem.what + (f" (with {named})" if named else ""))
        text = problem.where.file.removeprefix("--set ")
        is_key = problem.where.column <= text.index("=")
        return Problem(place.key if is_key else place.value, problem.what)


def _reserved(keys: tuple[str, ...]) -> str:
    """Why a level must not set the value with this path; empty if it may."""
    if keys == ("seed",):
        return "training draws the seeds of its runs from its own `seed`"
    is_network = len(keys) == 4 and (keys[0], *keys[2:]) == ("components", "parameters", NETWORK)
    if is_network or keys == ("components", COMPONENT, "parameters", BETA):
        return "training sets it"
    return ""


def _users(scenario: Scenario) -> tuple[str, ...]:
    """The components that use a network."""
    uses = scenario.components.items()
    return tuple(name for name, use in uses if NETWORK in use.type.parameters)


def _is_recorded(scenario: Scenario, name: str) -> bool:
    is_included = any(fnmatchcase(name, pattern) for pattern in scenario.include)
    return is_included and not any(fnmatchcase(name, pattern) for pattern in scenario.exclude)
