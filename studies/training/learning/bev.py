"""The learner of BEV networks: the expert's commands, and what the truth says of each place."""

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
import torch
from torch import Tensor
from torch.nn import functional
from typing_extensions import override

from fmus.driving.network.architecture import Architecture
from fmus.driving.network.checkpoint import read_network
from orchestrator.errors import ComponentTypeError
from orchestrator.parameters import parameter
from orchestrator.signal import Array
from studies.training.learner import RecordedRun
from studies.training.learning.batches import Batch, batch_of, delivered
from studies.training.learning.decision import imitation_loss
from studies.training.learning.imitation import ImitationLearner, NetworkParameters, Numbers
from studies.training.learning.lessons import Lessons, lessons
from studies.training.learning.mirror import mirrored
from studies.training.learning.model import Answer, DrivingModel
from studies.training.learning.sample import read_sample


@dataclass(frozen=True, slots=True, kw_only=True)
class BevParameters(NetworkParameters):
    """Shape of a BEV network, and what its learner pays attention to."""

    keypoints: int = parameter(32, minimum=1, doc="of a message")
    features: int = parameter(256, minimum=2, doc="of a keypoint")
    vectors: int = parameter(16, minimum=1, doc="among the features, vectors in the plane")
    spacing: int = parameter(1, minimum=1, doc="of keypoints, in blocks of 0.8 m")
    hidden: int = parameter(96, minimum=1, doc="units of the encoder")
    early: bool = parameter(
        default=False, doc="whether others send raw points, laid over the own ones"
    )
    looked_at: int = parameter(
        0, minimum=0, doc="keypoints of every scan, drawn for each batch; 0: all of them"
    )
    yielding_weight: float = parameter(
        8.0, minimum=1.0, doc="of moments in which the expert yields to what the network can see"
    )
    truth_weight: float = parameter(0.3, minimum=0.0, doc="of the loss on what places are")
    mirror: bool = parameter(
        default=False,
        doc="whether half of the moments have left and right swapped",
    )
    initial: str = parameter(
        "", doc="a network, by name or path, with whose weights it begins; empty: drawn ones"
    )

    @property
    @override
    def architecture(self) -> Architecture:
        names = {f.name for f in dataclasses.fields(Architecture)} - {"encoder"}
        return Architecture(**{name: getattr(self, name) for name in names})


class BevLearner(ImitationLearner[BevParameters, DrivingModel, Lessons]):
    """Learns from keypoints of the BEV encoder, and from the truth about each place."""

    Parameters: TypeAlias = BevParameters
    name = "bev"
    parts = ("accelerate", "brake", "steer", "vehicle", "truth")
    validated = 512

    @override
    def _network(self) -> DrivingModel:
        model = DrivingModel(self._architecture)
        if self._parameters.initial:
            model.layers.load(_known_weights(self._parameters.initial, self._architecture))
        return model

    @override
    def _weights(self) -> dict[str, Array]:
        return self._model.layers.weights()

    @override
    def _lessons(self, run: RecordedRun) -> Lessons:
        rng = np.random.default_rng([self._seed, run.seed])
        return lessons(map(read_sample, run.samples), self._architecture, rng)

    @override
    def _measured(self, known: Lessons, rows: Array, rng: np.random.Generator) -> Numbers:
        batch = self._batch(known, rows, rng)
        answer = self._model(batch.seen, batch.ego)
        given, truth = self._parameters, _truth_loss(batch, answer)
        imitation = imitation_loss(
            answer.command, batch.expert, batch.yields, batch.sees_threat, given.yielding_weight
        )
        errors = (answer.command - batch.expert).abs().mean(dim=0)
        right = ((answer.judgements[..., 0] > 0.0) == batch.vehicle)[batch.there]
        share = right.sum() / max(len(right), 1)
        return imitation + given.truth_weight * truth, *errors, share, truth

    def _batch(self, known: Lessons, rows: Array, rng: np.random.Generator) -> Batch:
        moments = known.moments[rows]
        given = self._parameters
        messages = given.messages if given.cooperative and not given.early else 0
        arrived = delivered(moments, messages, given.keypoints, rng)
        columns = rng.permutation(given.keypoints)[: given.looked_at or given.keypoints]
        batch = batch_of(known, moments, arrived, columns, self._device)
        if not given.mirror:
            return batch
        return mirrored(batch, torch.from_numpy(rng.random(len(moments)) < 0.5).to(self._device))


def _known_weights(network: str, architecture: Architecture) -> Mapping[str, Array]:
    """The weights of a network of this architecture.

    Raises:
        ValueError: there is none, or it is of another one.
    """
    try:
        checkpoint = read_network(network)
    except ComponentTypeError as error:
        raise ValueError(f"`initial`: {str(error).removeprefix('`network`: ')}") from error
    if checkpoint.architecture != architecture:
        raise ValueError(f"`initial`: the network `{network}` has other sizes than this one")
    return checkpoint.weights


def _truth_loss(batch: Batch, answer: Answer) -> Tensor:
    """The loss on vehicles, moving ones, and their velocities; 0 where there is no place."""
    there = batch.there
    if not bool(there.any()):
        return answer.judgements.sum() * 0.0
    target = torch.stack([batch.vehicle, batch.moving], dim=-1).float()[there]
    judged = functional.binary_cross_entropy_with_logits(answer.judgements[there], target)
    vehicles = there & batch.vehicle
    if not bool(vehicles.any()):
        return judged
    wrong = functional.smooth_l1_loss(answer.velocity[vehicles], batch.velocity[vehicles])
    return judged + 0.3 * wrong
