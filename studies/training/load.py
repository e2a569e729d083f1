"""From a training file to a `Training`: every problem at once, each at its place."""

import itertools
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Final

from orchestrator.campaign import loading
from orchestrator.campaign.loading import Factors
from orchestrator.errors import ComponentTypeError
from orchestrator.scenario import diagnosis
from orchestrator.suggestion import suggestion
from studies.training.encounters import Encounter
from studies.training.learner import (
    Learner,
    Optimisation,
    create_learner,
    declared_parameters,
    learner_type,
)
from studies.training.load_encounters import EncounterLoad, Section, held_out_variants
from studies.training.parameters import converted
from studies.training.plan import BETA, COMPONENT, NETWORK, Training
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
        checkpoint = self._folder("checkpoint") / self.file.checkpoint
        checkpoint = checkpoint.resolve()
        self._check_checkpoint(checkpoint)
        self._check_counts()
        sections = [*self._sections()]
        for section in sections:
            owned = itertools.chain(section.fixed(), section.factors.settings())
            self.source.check_paths(owned, _reserved)
        self._check_variants()
        learner = self._learner()
        parameters = {} if learner is None else self._parameters(learner)
        self.source.stop_at_problems()
        assert learner is not None  # noqa: S101 - or there was a problem
        self._check_learner(learner, parameters)
        encounters = tuple(EncounterLoad(self.source, section).encounter() for section in sections)
        self.source.stop_at_problems()
        variants = held_out_variants(self.source, self.file.held_out, encounters)
        self.source.stop_at_problems()
        known = tuple(each.encounter for each in encounters)
        learned = tuple(each for each in known if not each.is_held_out)
        unseen = tuple(each for each in known if each.is_held_out)
        return self._planned(learned, (*unseen, *variants), checkpoint, learner, parameters)

    def _folder(self, key: str) -> Path:
        """Where the relative path under `key` starts."""
        return self.source.document.folder((key,))

    def _sections(self) -> Iterator[Section]:
        """The encounters as they are written."""
        file = self.file
        common = (file.set, ("set",))
        if bool(file.scenario) == bool(file.encounters):
            what = "write one of `scenario` and `encounters`"
            self.source.add(("encounters",) if file.encounters else (), what, at_key=True)
            return
        if file.scenario:
            yield Section(
                name="",
                scenario=self.scenario_path(file.scenario),
                address=("scenario",),
                settings=(common,),
                factors=self.factors,
            )
            return
        if file.scenes:
            what = "each of the `encounters` has its own; write them there"
            self.source.add(("scenes",), what, at_key=True)
        for name, each in file.encounters.items():
            address = ("encounters", name)
            yield Section(
                name=name,
                scenario=self.scenario_path(each.scenario, (*address, "scenario")),
                address=(*address, "scenario"),
                weight=each.weight,
                settings=(common, (each.set, (*address, "set"))),
                factors=Factors(self.source, (*address, "scenes"), each.scenes),
            )

    def _check_variants(self) -> None:
        file = self.file
        names = [*file.encounters] or [""]
        for name, each in file.held_out.items():
            address = ("held_out", name)
            if each.encounter not in names:
                what = f"there is no encounter `{each.encounter}`; "
                what += suggestion(each.encounter, file.encounters)
                self.source.add((*address, "encounter"), what)
            if name in names:
                self.source.add(address, "an encounter has this name", at_key=True)
            settings = ((f"`{name}`", (*address, "set", path)) for path in each.set)
            self.source.check_paths(settings, _reserved)
        sections = file.encounters.values()
        if sections and not any(each.weight for each in sections):
            what = "all of them have the weight 0; there is nothing to learn from"
            self.source.add(("encounters",), what, at_key=True)
        if file.held_out and file.evaluation is None:
            what = "nobody drives in them; write how often, e.g. `evaluation: {runs: 20}`"
            self.source.add(("held_out",), what, at_key=True)

    def _planned(
        self,
        encounters: tuple[Encounter, ...],
        variants: tuple[Encounter, ...],
        checkpoint: Path,
        learner: type[Learner],
        parameters: Mapping[str, Any],
    ) -> Training:
        file = self.file
        return Training(
            path=self.path,
            encounters=encounters,
            held_out=variants,
            seed=file.seed,
            expert_seed=file.expert.seed,
            learner_name=file.network[TYPE],
            learner=learner,
            parameters=parameters,
            network=file.network,
            expert_runs=file.expert.runs,
            validation_runs=file.validation.runs,
            drives=file.validation.drives,
            evaluation_runs=0 if file.evaluation is None else file.evaluation.runs,
            rounds=file.dagger.rounds,
            round_runs=file.dagger.runs,
            beta=file.dagger.beta,
            decay=file.dagger.decay,
            optimisation=self._optimisation,
            device=file.device,
            checkpoint=checkpoint,
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
        unseen = file.validation.runs + (file.evaluation.runs if file.evaluation else 0)
        if unseen > MAXIMUM_RUNS:
            what = f"with those of `validation` {unseen} runs, more than {MAXIMUM_RUNS}"
            self.source.add(("evaluation", "runs"), what)
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
        found = converted(declared_parameters(learner), given, self._folder("network"))
        for problem in found.problems:
            self.source.add(("network", *problem.address), problem.what, at_key=problem.at_key)
        return found.values

    def _check_learner(self, learner: type[Learner], parameters: Mapping[str, Any]) -> None:
        """Whether it can be created, before hours of driving."""
        try:
            create_learner(learner, parameters, self._optimisation, self.file.seed, "cpu")
        except (ValueError, ImportError) as error:
            self.source.add(("network",), str(error), at_key=True)


def _reserved(keys: tuple[str, ...]) -> str:
    """Why a level must not set the value with this path; empty if it may."""
    if keys == ("seed",):
        return "training draws the seeds of its runs from its own `seed`; remove it"
    is_network = len(keys) == 4 and (keys[0], *keys[2:]) == ("components", "parameters", NETWORK)
    if is_network or keys == ("components", COMPONENT, "parameters", BETA):
        return "training sets it; remove it"
    return ""
