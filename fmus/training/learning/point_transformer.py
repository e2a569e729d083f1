"""The learner of networks with a point transformer: the expert's commands, end to end."""

import dataclasses
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Final, TypeAlias

import numpy as np
import torch
from torch import Tensor
from typing_extensions import override

from fmus.network.architecture import POINT_TRANSFORMER, Architecture
from fmus.network.checkpoint import Checkpoint
from fmus.training.learner import EpochResult, Learner, Optimisation, RecordedRun
from fmus.training.learning.batches import delivered
from fmus.training.learning.cloud_lessons import (
    CloudBatch,
    CloudLessons,
    cloud_batch_of,
    cloud_lessons,
)
from fmus.training.learning.cloud_model import CloudDrivingModel
from fmus.training.learning.decision import imitation_loss
from fmus.training.learning.descent import Descent
from fmus.training.learning.sample import read_sample
from orchestrator.parameters import parameter
from orchestrator.signal import Array

_VALIDATED: Final = 32
"""Moments that are validated at a time."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PointTransformerParameters:
    """Shape of a network with a point transformer, and what its learner pays attention to."""

    keypoints: int = parameter(128, minimum=16, doc="of a message")
    features: int = parameter(128, minimum=1, doc="of a keypoint: 128, or 256 after a third block")
    fused: int = parameter(96, minimum=1, doc="units of the fusion's first layer")
    pooled: int = parameter(64, minimum=1, doc="units of which the maximum is taken")
    head: int = parameter(64, minimum=1, doc="units of the head")
    cooperative: bool = parameter(default=True, doc="whether it uses messages of others")
    messages: int = parameter(2, minimum=1, maximum=10, doc="of others, used at a time")
    yielding_weight: float = parameter(
        8.0, minimum=1.0, doc="of moments in which the expert yields to somebody"
    )

    @property
    def architecture(self) -> Architecture:
        """Of the network.

        Raises:
            ValueError: there is none with this number of features.
        """
        names = {field.name for field in dataclasses.fields(Architecture)}
        given = {k: v for k, v in dataclasses.asdict(self).items() if k in names}
        return Architecture(**given, vectors=0, encoder=POINT_TRANSFORMER)


class PointTransformerLearner(Learner):
    """Learns commands of the expert from clouds, as the radio delivers their keypoints.

    Encoder, fusion and head learn together, from the loss on the command alone. Messages are lost
    as for the BEV networks, anew in each epoch. Samples need points: `points` of `policy-dagger`.
    """

    Parameters: TypeAlias = PointTransformerParameters

    def __init__(
        self,
        parameters: PointTransformerParameters,
        optimisation: Optimisation,
        seed: int,
        device: str,
    ) -> None:
        torch.set_num_threads(1)
        self._parameters = parameters
        self._seed = seed
        self._device = torch.device(device)
        self._architecture = parameters.architecture
        torch.manual_seed(seed)
        self._model = CloudDrivingModel(self._architecture, seed).to(self._device)
        self._descent = Descent(self._model, optimisation, seed)
        self._training: CloudLessons | None = None
        self._validation: CloudLessons | None = None

    @override
    def add(self, runs: Iterable[RecordedRun]) -> None:
        known = [] if self._training is None else [self._training]
        self._training = CloudLessons.of([*known, *map(self._lessons, runs)])

    @override
    def add_validation(self, runs: Iterable[RecordedRun]) -> None:
        self._validation = CloudLessons.of([self._lessons(run) for run in runs])

    @override
    def begin_round(self, number: int) -> None:
        self._descent.begin_round(number)

    @override
    def epoch(self) -> EpochResult:
        known = self._training
        if known is None or self._validation is None:
            raise RuntimeError("there is nothing to learn from yet")

        def loss(rows: Array, rng: np.random.Generator) -> Tensor:
            batch = self._batch(known, rows, rng)
            return self._loss(self._model(batch), batch)

        self._model.train()
        training = self._descent.epoch(len(known), loss)
        self._model.eval()
        validation, parts = self._validated(self._validation)
        return EpochResult(training=training, validation=validation, parts=parts)

    @override
    def state(self) -> bytes:
        return self._descent.state()

    @override
    def restore(self, state: bytes) -> None:
        self._descent.restore(state)

    @override
    def export(self, path: Path) -> None:
        Checkpoint(
            architecture=self._architecture,
            weights=self._model.weights(),
            origin={
                "learner": POINT_TRANSFORMER,
                "seed": str(self._seed),
                "round": str(self._descent.round),
            },
        ).write(path)

    def _lessons(self, run: RecordedRun) -> CloudLessons:
        return cloud_lessons(map(read_sample, run.samples), self._architecture)

    def _batch(self, known: CloudLessons, rows: Array, rng: np.random.Generator) -> CloudBatch:
        moments = known.moments[rows]
        messages = self._parameters.messages if self._parameters.cooperative else 0
        arrived = delivered(moments, messages, self._parameters.keypoints, rng)
        return cloud_batch_of(known, moments, arrived, rng, self._device)

    def _loss(self, command: Tensor, batch: CloudBatch) -> Tensor:
        weight = self._parameters.yielding_weight  # which points are of whom, samples do not say
        seen = torch.ones_like(batch.yields)
        return imitation_loss(command, batch.expert, batch.yields, seen, weight)

    def _validated(self, known: CloudLessons) -> tuple[float, dict[str, float]]:
        """Mean loss over all moments and its parts; the same messages are lost every time."""
        rng = np.random.default_rng([self._seed, 1 << 32])
        sums = np.zeros(4)
        with torch.no_grad():
            for first in range(0, len(known), _VALIDATED):
                rows = np.arange(first, min(first + _VALIDATED, len(known)))
                batch = self._batch(known, rows, rng)
                command = self._model(batch)
                errors = (command - batch.expert).abs().mean(dim=0)
                numbers = [self._loss(command, batch), *errors]
                sums += len(rows) * np.array([float(number) for number in numbers])
        means = (sums / len(known)).tolist()
        return means[0], dict(zip(("accelerate", "brake", "steer"), means[1:], strict=True))
