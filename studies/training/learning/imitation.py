"""Learning the expert's commands: what learners of all encoders share."""

import abc
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar, Final, Generic, TypeVar

import numpy as np
import torch
from torch import Tensor, nn
from typing_extensions import override

from fmus.driving.network.architecture import Architecture
from fmus.driving.network.checkpoint import Checkpoint
from orchestrator.parameters import parameter
from orchestrator.signal import Array
from studies.training.learner import EpochResult, Learner, Optimisation, RecordedRun
from studies.training.learning.descent import Descent
from studies.training.learning.lessons import Moments

_VALIDATION: Final = 1 << 32
"""What stands in the place of a round for what is drawn while validating."""


@dataclass(frozen=True, slots=True, kw_only=True)
class NetworkParameters(abc.ABC):
    """Shape of a network behind its encoder, and what its learner pays attention to."""

    fused: int = parameter(96, minimum=1, doc="units of the fusion's first layer")
    pooled: int = parameter(64, minimum=1, doc="units of which the maximum is taken")
    head: int = parameter(64, minimum=1, doc="units of the head")
    cooperative: bool = parameter(default=True, doc="whether it uses messages of others")
    messages: int = parameter(2, minimum=1, maximum=10, doc="of others, used at a time")

    @property
    @abc.abstractmethod
    def architecture(self) -> Architecture:
        """The architecture of the network.

        Raises:
            ValueError: there is none of these sizes.
        """


ShapeT = TypeVar("ShapeT", bound=NetworkParameters)
ModelT = TypeVar("ModelT", bound=nn.Module)
LessonsT = TypeVar("LessonsT", bound=Moments)
Numbers = Sequence[Tensor]


class ImitationLearner(Learner, Generic[ShapeT, ModelT, LessonsT]):
    """Learns commands of the expert from what the radio would have delivered.

    In each epoch messages are lost anew, with a rate drawn for each moment. Weights and order of
    the samples depend on the seed, the round and the epoch only.
    """

    name: ClassVar[str]
    """The name of the learner, in checkpoints."""
    parts: ClassVar[tuple[str, ...]]
    """What `_measured` returns behind the loss."""
    validated: ClassVar[int]
    """Moments that are validated at a time."""

    def __init__(
        self, parameters: ShapeT, optimisation: Optimisation, seed: int, device: str
    ) -> None:
        torch.set_num_threads(1)
        torch.manual_seed(seed)
        self._parameters = parameters
        self._seed = seed
        self._device = torch.device(device)
        self._architecture = parameters.architecture
        self._model = self._network().to(self._device)
        self._descent = Descent(self._model, optimisation, seed)
        self._training: LessonsT | None = None
        self._validation: LessonsT | None = None

    @abc.abstractmethod
    def _network(self) -> ModelT:
        """A network of `_architecture`, whose first weights depend on the seed."""

    @abc.abstractmethod
    def _weights(self) -> dict[str, Array]:
        """The weights of the network by their names in a checkpoint, float64."""

    @abc.abstractmethod
    def _lessons(self, run: RecordedRun) -> LessonsT:
        """What a run teaches."""

    @abc.abstractmethod
    def _measured(self, known: LessonsT, rows: Array, rng: np.random.Generator) -> Numbers:
        """The loss, and then the `parts`, each a mean over these moments.

        Args:
            known: what the moments are of.
            rows: indices of the moments.
            rng: draws which messages arrive.
        """

    @override
    def add(self, runs: Iterable[RecordedRun]) -> None:
        known = [] if self._training is None else [self._training]
        self._training = _joined([*known, *map(self._lessons, runs)])

    @override
    def add_validation(self, runs: Iterable[RecordedRun]) -> None:
        self._validation = _joined([self._lessons(run) for run in runs])

    @override
    def begin_round(self, number: int) -> None:
        self._descent.begin_round(number)

    @override
    def epoch(self) -> EpochResult:
        known = self._training
        if known is None or self._validation is None:
            raise RuntimeError("there is nothing to learn from yet")
        self._model.train()
        training = self._descent.epoch(
            len(known), lambda rows, rng: self._measured(known, rows, rng)[0]
        )
        self._model.eval()
        validation, *parts = self._validate(self._validation)
        named = dict(zip(self.parts, parts, strict=True))
        return EpochResult(training=training, validation=validation, parts=named)

    @override
    def state(self) -> bytes:
        return self._descent.state()

    @override
    def restore(self, state: bytes) -> None:
        self._descent.restore(state)

    @override
    def export(self, path: Path) -> None:
        seed, number = str(self._seed), str(self._descent.round)
        Checkpoint(
            architecture=self._architecture,
            weights=self._weights(),
            origin={"learner": self.name, "seed": seed, "round": number},
        ).write(path)

    def _validate(self, known: LessonsT) -> list[float]:
        """Means over all moments; the same messages are lost every time."""
        rng = np.random.default_rng([self._seed, _VALIDATION])
        sums = np.zeros(1 + len(self.parts))
        with torch.no_grad():
            for first in range(0, len(known), self.validated):
                rows = np.arange(first, min(first + self.validated, len(known)))
                found = [float(number) for number in self._measured(known, rows, rng)]
                sums += len(rows) * np.array(found)
        means: list[float] = (sums / len(known)).tolist()
        return means


def _joined(parts: Sequence[LessonsT]) -> LessonsT:
    """All parts, one after the other."""
    return type(parts[0]).of(parts)
