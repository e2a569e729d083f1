"""Learners: what makes a network of recorded samples.

`nlosim train` decides what is driven and when to stop; a learner knows the network, the samples and
the loss. It is found by an entry point in the group `orchestrator.learners`, whose value is a class
derived from `Learner`:

    class Straight(Learner):
        '''A straight line.'''

        @dataclass(frozen=True, slots=True, kw_only=True)
        class Parameters:
            degree: int = parameter(1, minimum=1, doc="of the polynomial")

        def __init__(self, parameters, optimisation, seed, device) -> None: ...
"""

import abc
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from orchestrator.installed import installed_class
from orchestrator.parameters import Parameter, declared

GROUP: Final = "orchestrator.learners"


@dataclass(frozen=True, slots=True, kw_only=True)
class RecordedRun:
    """What one run has to teach.

    Attributes:
        seed: of the run.
        levels: which scene was driven: the level of every factor of `scenes`.
        samples: values of the output `policy.sample` in the order of time, empty ones left out.
    """

    seed: int
    levels: Mapping[str, str]
    samples: tuple[bytes, ...] = field(repr=False)


@dataclass(frozen=True, slots=True, kw_only=True)
class Optimisation:
    """How to optimise in every round.

    Attributes:
        epochs: at most.
        batch: samples in one step.
        rate: learning rate, at the beginning if the learner lowers it.
        weight_decay: factor of the penalty on the weights.
        patience: epochs without a better validation loss after which a round ends.
    """

    epochs: int
    batch: int
    rate: float
    weight_decay: float
    patience: int


@dataclass(frozen=True, slots=True, kw_only=True)
class EpochResult:
    """What an epoch came to; all numbers finite, or the training ends with an error.

    Attributes:
        training: mean loss over the training samples, while learning from them.
        validation: mean loss over the validation samples, after the epoch.
        parts: further numbers for the log by name, e.g. `validation.steer`; the same names after
            every epoch.
    """

    training: float
    validation: float
    parts: Mapping[str, float] = field(default_factory=dict)


class Learner(abc.ABC):
    """A network in training.

    Two learners that were created with equal arguments, were given equal runs in the same order
    and `restore`d from the same state go on equally on the same machine. A training that goes on
    creates a learner, adds all runs until then, restores the end of the round before, begins the
    round, and restores the newest epoch of it, if there is one.

    Args:
        parameters: an instance of the nested dataclass `Parameters`, whose fields are declared as
            those of components (`orchestrator.parameters`); `None` if there is none.
        optimisation: how to optimise.
        seed: of all that is random: initial weights, batches.
        device: `cpu` or `cuda`.
    """

    @abc.abstractmethod
    def __init__(
        self, parameters: Any, optimisation: Optimisation, seed: int, device: str
    ) -> None: ...

    @abc.abstractmethod
    def add(self, runs: Iterable[RecordedRun]) -> None:
        """Learn from these runs, too, from the next epoch on. It changes no part of the state.

        Called once per round, before `begin_round`. Runs are read from the disk one by one while
        they are iterated over; their samples are as the scenario's policy made them.

        Raises:
            ValueError: a sample is not one of this learner's.
        """

    @abc.abstractmethod
    def add_validation(self, runs: Iterable[RecordedRun]) -> None:
        """Validate with these runs; called once, before the first round.

        Raises:
            ValueError: a sample is not one of this learner's.
        """

    @abc.abstractmethod
    def begin_round(self, number: int) -> None:
        """Begin a round with the weights that there are: a fresh optimiser and schedule.

        Args:
            number: 0 for behaviour cloning, then those of DAgger.
        """

    @abc.abstractmethod
    def epoch(self) -> EpochResult:
        """Learn from every training sample once, in an order of its own, then validate."""

    @abc.abstractmethod
    def state(self) -> bytes:
        """All but the samples: weights, optimiser, schedule, random generators. No pickle."""

    @abc.abstractmethod
    def restore(self, state: bytes) -> None:
        """Go back, or forth, to a state of this round or of the end of the one before.

        Raises:
            ValueError: it is no state of a learner with these parameters.
        """

    @abc.abstractmethod
    def export(self, path: Path) -> None:
        """Write the checkpoint that policies read.

        Args:
            path: of the new file; its folder exists.
        """


def learner_type(name: str) -> type[Learner]:
    """Load the learner called `name`.

    Raises:
        ComponentTypeError: it is not installed, or cannot be loaded.
    """
    return installed_class(GROUP, name, Learner, "learner")  # type: ignore[type-abstract]


def declared_parameters(learner: type[Learner]) -> Mapping[str, Parameter]:
    """The parameters on offer, by name."""
    record: Any = getattr(learner, "Parameters", None)
    return {} if record is None else declared(record)


def create_learner(
    learner: type[Learner],
    values: Mapping[str, Any],
    optimisation: Optimisation,
    seed: int,
    device: str,
) -> Learner:
    """A learner with these values of its parameters; missing ones take their defaults.

    Raises:
        ValueError: the values do not fit together.
    """
    record: Any = getattr(learner, "Parameters", None)
    parameters = None if record is None else record(**values)
    return learner(parameters, optimisation, seed, device)
