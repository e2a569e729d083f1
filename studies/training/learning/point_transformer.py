"""The learner of networks with a point transformer: the expert's commands, end to end."""

import dataclasses
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
import torch
from typing_extensions import override

from fmus.driving.network.architecture import POINT_TRANSFORMER, Architecture
from orchestrator.parameters import parameter
from orchestrator.signal import Array
from studies.training.learner import RecordedRun
from studies.training.learning.batches import delivered
from studies.training.learning.cloud_lessons import (
    CloudBatch,
    CloudLessons,
    cloud_batch_of,
    cloud_lessons,
)
from studies.training.learning.cloud_model import CloudDrivingModel
from studies.training.learning.decision import imitation_loss
from studies.training.learning.imitation import ImitationLearner, NetworkParameters, Numbers
from studies.training.learning.sample import read_sample


@dataclass(frozen=True, slots=True, kw_only=True)
class PointTransformerParameters(NetworkParameters):
    """Shape of a network with a point transformer, and what its learner pays attention to."""

    keypoints: int = parameter(128, minimum=16, doc="of a message")
    features: int = parameter(128, minimum=1, doc="of a keypoint: 128, or 256 after a third block")
    yielding_weight: float = parameter(
        8.0, minimum=1.0, doc="of moments in which the expert yields to somebody"
    )

    @property
    @override
    def architecture(self) -> Architecture:
        names = {field.name for field in dataclasses.fields(Architecture)}
        given = {k: v for k, v in dataclasses.asdict(self).items() if k in names}
        return Architecture(**given, vectors=0, encoder=POINT_TRANSFORMER)


class PointTransformerLearner(
    ImitationLearner[PointTransformerParameters, CloudDrivingModel, CloudLessons]
):
    """Learns from clouds; encoder, fusion and head together, from the loss on the command alone.

    Samples need points: `points` of `policy-dagger`.
    """

    Parameters: TypeAlias = PointTransformerParameters
    name = POINT_TRANSFORMER
    parts = ("accelerate", "brake", "steer")
    validated = 32

    @override
    def _network(self) -> CloudDrivingModel:
        return CloudDrivingModel(self._architecture, self._seed)

    @override
    def _weights(self) -> dict[str, Array]:
        return self._model.weights()

    @override
    def _lessons(self, run: RecordedRun) -> CloudLessons:
        return cloud_lessons(map(read_sample, run.samples), self._architecture)

    @override
    def _measured(self, known: CloudLessons, rows: Array, rng: np.random.Generator) -> Numbers:
        batch = self._batch(known, rows, rng)
        command = self._model(batch)
        weight = self._parameters.yielding_weight  # which points are of whom, samples do not say
        seen = torch.ones_like(batch.yields)
        loss = imitation_loss(command, batch.expert, batch.yields, seen, weight)
        return loss, *(command - batch.expert).abs().mean(dim=0)

    def _batch(self, known: CloudLessons, rows: Array, rng: np.random.Generator) -> CloudBatch:
        moments = known.moments[rows]
        messages = self._parameters.messages if self._parameters.cooperative else 0
        arrived = delivered(moments, messages, self._parameters.keypoints, rng)
        return cloud_batch_of(known, moments, arrived, rng, self._device)
