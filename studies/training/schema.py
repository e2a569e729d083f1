"""The shape of a training file."""

from typing import Annotated, Any, Final, Literal

from pydantic import BaseModel, ConfigDict, Field

from orchestrator.experiment.schema import Settings
from orchestrator.scenario.schema import Name, Text

MAXIMUM_RUNS: Final = 500_000
"""Runs to train on, or to validate with, of one training; its seeds leave room for so many."""

MAXIMUM_SEED: Final = 1_000_000
"""The largest `seed`; the seeds of its runs lie a million times above."""

Runs = Annotated[int, Field(ge=1, le=MAXIMUM_RUNS)]
Share = Annotated[float, Field(ge=0.0, le=1.0)]


class _Mapping(BaseModel):
    model_config = ConfigDict(
        extra="forbid", frozen=True, strict=True, use_attribute_docstrings=True
    )


class Expert(_Mapping):
    """Behaviour cloning: the expert drives, the network learns what it did."""

    runs: Runs
    """How many."""

    seed: Annotated[int, Field(ge=0, le=MAXIMUM_SEED)] | None = None
    """Seeds and scenes of these runs, and those of `validation` and `evaluation`, are drawn from
    this number instead of the training's `seed`: trainings with equal ones have the same runs."""


class Dagger(_Mapping):
    """DAgger: the network drives, and learns what the expert would have done."""

    rounds: Annotated[int, Field(ge=0, le=1000)]
    """How many times the network drives and learns; 0 leaves it at behaviour cloning."""

    runs: Runs
    """How many in each round."""

    beta: Share = 0.5
    """How often the expert's command is taken instead of the network's, in the first round."""

    decay: Share = 0.5
    """The factor by which `beta` changes from round to round."""


class Validation(_Mapping):
    """Scenes that are never learned from."""

    runs: Runs
    """How many, driven by the expert; the loss in them ends a round."""

    drives: Annotated[int, Field(ge=0, le=MAXIMUM_RUNS)] = 0
    """The network drives alone in so many of these scenes after each round. The round with the
    best drives gives the checkpoint; without drives, the last."""


class OptimisationSection(_Mapping):
    """How the network is optimised in every round."""

    epochs: Annotated[int, Field(ge=1, le=100_000)]
    """The most epochs in each round; `patience` may end it earlier."""

    batch: Annotated[int, Field(ge=1)]
    """Samples in one step."""

    rate: Annotated[float, Field(gt=0.0, le=10.0, allow_inf_nan=False)]
    """Learning rate."""

    weight_decay: Annotated[float, Field(ge=0.0, le=10.0, allow_inf_nan=False)] = 0.0
    """Factor of the penalty on the weights."""

    patience: Annotated[int, Field(ge=1)]
    """A round ends after so many epochs without a better validation loss."""


Scenes = dict[Name, Annotated[dict[Text, Settings], Field(min_length=1)]]
"""What varies from run to run: by the name of the factor and of the level, the values that it
sets."""


class EncounterSection(_Mapping):
    """One of several encounters that are learned from."""

    scenario: Text
    """The scenario file, as that of a training with one."""

    weight: Annotated[int, Field(ge=0, le=1000)] = 1
    """So many runs in turn are of it; with 0 it is held out, as a variant is."""

    set: Settings = {}
    """Values of the scenario in every run."""

    scenes: Scenes = {}
    """What varies from run to run."""


class HeldOut(_Mapping):
    """A variant of an encounter that is never learned from, nor validated with."""

    encounter: str = ""
    """The encounter that it is a variant of; without `encounters`, the scenario."""

    set: Annotated[Settings, Field(min_length=1)]
    """What makes it one. Factors that set one of these values do not vary in it."""


class Evaluation(_Mapping):
    """Drives of the chosen network, at the end."""

    runs: Runs
    """How many in each encounter, and in each variant that is held out."""


class TrainingFile(_Mapping):
    """What is driven, by whom, and what learns from it."""

    version: Annotated[Literal[1], Field(alias="schema")]
    """The version of the form of this file."""

    scenario: Text = ""
    """The scenario file, relative to this file, or an installed scenario by its name. Its component
    `policy` has the parameters `network` and `beta`, and the recorded output `sample`. In its place
    there may be `encounters`."""

    encounters: dict[Text, EncounterSection] = {}
    """Several scenarios, by the name of the encounter. Runs take turns."""

    set: Settings = {}
    """Values of the scenario, or of all encounters, in every run."""

    held_out: dict[Text, HeldOut] = {}
    """Variants of encounters by name, which the chosen network drives in at the end."""

    evaluation: Evaluation | None = None
    """Drives at the end; without, there are none."""

    seed: Annotated[int, Field(ge=0, le=MAXIMUM_SEED)] = 1
    """Initial weights, batches, and the seeds and scenes of all runs are drawn from this number."""

    network: Annotated[dict[Text, Any], Field(min_length=1)]
    """`type`, an installed learner (entry points `orchestrator.learners`), and its parameters."""

    scenes: Scenes = {}
    """What varies from run to run: by the name of the factor and of the level, the values that it
    sets. Each run draws one level of every factor."""

    expert: Expert
    """The runs of behaviour cloning."""

    dagger: Dagger
    """The rounds after it."""

    validation: Validation
    """What early stopping looks at."""

    optimisation: OptimisationSection
    """How the network is optimised; this is the same in every round."""

    device: Literal["auto", "cpu", "cuda"] = "auto"
    """Where to learn; `auto` is `cuda` where there is one."""

    checkpoint: Text
    """Where the trained network goes, relative to this file; an older one is replaced."""
