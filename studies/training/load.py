"""From a training file to a `Training`: every problem at once, each at its place."""

import contextlib
import itertools
from collections.abc import Mapping
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any, Final

from orchestrator.campaign import loading
from orchestrator.errors import ComponentTypeError
from orchestrator.scenario import diagnosis
from orchestrator.scenario.build import load_scenario
from orchestrator.scenario.model import Scenario
from orchestrator.scenario.wiring import Assembly, assemble
from orchestrator.signal import Causality
from studies.training.learner import (
    Learner,
    Optimisation,
    create_learner,
    declared_parameters,
    learner_type,
)
from studies.training.parameters import converted
from studies.training.plan import (
    BETA,
    COMPONENT,
    NETWORK,
    SAMPLE,
    Training,
    driver_texts,
)
from studies.training.schema import MAXIMUM_RUNS, TrainingFile

TYPE: Final = "type"
"""The key of `network` that names the learner."""


def load_training(path: Path) -> Training:
    """Read and check a training file, and the scenario at every level of every factor.

    Args:
        path: of the file; paths in it are relative to its folder.

    Raises:
        ScenarioError: all problems, each at its place in the training file or the scenario.
    """
    return _Load.of(path, TrainingFile, "training", "scenes").training()


class _Load(loading.Load[TrainingFile]):
    """One reading of a training file."""

    def training(self) -> Training:
        scenario = self.scenario_path(self.file.scenario)
        checkpoint = (self.path.parent / self.file.checkpoint).resolve()
        self._check_checkpoint(checkpoint)
        self._check_counts()
        self.source.check_paths(self.factors.settings(), _reserved)
        learner = self._learner()
        parameters = {} if learner is None else self._parameters(learner)
        self.source.stop_at_problems()
        assert learner is not None  # noqa: S101 - or there was a problem
        self._check_learner(learner, parameters)
        first = self._scenes(scenario)
        self.source.stop_at_problems()
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
            resolved=loading.resolved(scenario),
        )

    @property
    def _optimisation(self) -> Optimisation:
        return Optimisation(**self.file.optimisation.model_dump())

    def _check_checkpoint(self, checkpoint: Path) -> None:
        if checkpoint.is_dir():
            self.source.add(("checkpoint",), f"{checkpoint} is a folder; write the name of a file")
        elif not checkpoint.parent.is_dir():
            self.source.add(("checkpoint",), f"there is no folder {checkpoint.parent}; create it")

    def _check_counts(self) -> None:
        file = self.file
        runs = file.expert.runs + file.dagger.rounds * file.dagger.runs
        if runs > MAXIMUM_RUNS:
            what = f"{runs} runs to learn from are more than {MAXIMUM_RUNS}"
            self.source.add(("dagger", "rounds"), what)
        if file.validation.drives > file.validation.runs:
            what = f"more than the {file.validation.runs} scenes of `validation.runs`"
            self.source.add(("validation", "drives"), what)

    def _learner(self) -> type[Learner] | None:
        name = self.file.network.get(TYPE)
        if not isinstance(name, str):
            at_key = name is None
            what = "`type` is missing" if at_key else f"expected text, got {diagnosis.show(name)}"
            self.source.add(("network",) if at_key else ("network", TYPE), what, at_key=at_key)
            return None
        try:
            return learner_type(name)
        except ComponentTypeError as error:
            is_absent = isinstance(error.__cause__, ImportError)
            hint = "; our learners need: pip install 'nlosim[train]'" if is_absent else ""
            self.source.add(("network", TYPE), f"{error}{hint}")
            return None

    def _parameters(self, learner: type[Learner]) -> Mapping[str, Any]:
        """The parameters of the learner, converted."""
        given = {name: value for name, value in self.file.network.items() if name != TYPE}
        found = converted(declared_parameters(learner), given, self.path.parent)
        for problem in found.problems:
            self.source.add(("network", *problem.address), problem.what, at_key=problem.at_key)
        return found.values

    def _check_learner(self, learner: type[Learner], parameters: Mapping[str, Any]) -> None:
        """Whether it can be created, before hours of driving."""
        try:
            create_learner(learner, parameters, self._optimisation, self.file.seed, "cpu")
        except (ValueError, ImportError) as error:
            self.source.add(("network",), str(error), at_key=True)

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
        overrides = self.factors.overrides(levels)
        with self.factors.loading(levels):
            plain = load_scenario(path, overrides)
            if not self._is_trainable(plain):
                return None
            scenario = load_scenario(path, [*overrides, *driver_texts(_users(plain), None, 1.0)])
            with contextlib.closing(assemble(scenario)) as assembly:
                self._check_sample(scenario, assembly)
            return scenario
        return None

    def _is_trainable(self, scenario: Scenario) -> bool:
        use = scenario.components.get(COMPONENT)
        if use is None:
            what = f"the scenario has no component `{COMPONENT}`, which training drives with"
            self.source.add(("scenario",), what)
            return False
        missing = [n for n in (NETWORK, BETA) if n not in use.type.parameters]
        if missing:
            named = " and ".join(f"`{name}`" for name in missing)
            what = f"`{COMPONENT}` of the scenario is of the type `{use.origin()}`, which has no "
            what += f"parameter {named}; training needs one that has, such as `policy-dagger`"
            self.source.add(("scenario",), what)
        return not missing

    def _check_sample(self, scenario: Scenario, assembly: Assembly) -> None:
        name = f"{COMPONENT}.{SAMPLE}"
        connector = assembly.system.connectors[COMPONENT].get(SAMPLE)
        if connector is None or connector.causality is not Causality.OUTPUT:
            self.source.add(
                ("scenario",), f"there is no output `{name}`, which training learns from"
            )
        elif not connector.is_binary:
            what = f"`{name}` is {connector.kind()}; training reads bytes"
            self.source.add(("scenario",), what)
        elif not _is_recorded(scenario, name):
            self.source.add(("scenario",), f"its `recording` leaves `{name}` out; include it")


def _reserved(keys: tuple[str, ...]) -> str:
    """Why a level must not set the value with this path; empty if it may."""
    if keys == ("seed",):
        return "training draws the seeds of its runs from its own `seed`; remove it"
    is_network = len(keys) == 4 and (keys[0], *keys[2:]) == ("components", "parameters", NETWORK)
    if is_network or keys == ("components", COMPONENT, "parameters", BETA):
        return "training sets it; remove it"
    return ""


def _users(scenario: Scenario) -> tuple[str, ...]:
    """The components that use a network."""
    uses = scenario.components.items()
    return tuple(name for name, use in uses if NETWORK in use.type.parameters)


def _is_recorded(scenario: Scenario, name: str) -> bool:
    is_included = any(fnmatchcase(name, pattern) for pattern in scenario.include)
    return is_included and not any(fnmatchcase(name, pattern) for pattern in scenario.exclude)
