"""The learner of BEV networks: the expert's commands, and what the truth says of each place."""

import dataclasses
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias

import numpy as np
import torch
from torch import Tensor
from torch.nn import functional
from typing_extensions import override

from fmus.network.architecture import Architecture
from fmus.network.checkpoint import Checkpoint
from fmus.training.learner import EpochResult, Learner, Optimisation, RecordedRun
from fmus.training.learning.batches import Batch, batch_of, delivered
from fmus.training.learning.decision import imitation_loss
from fmus.training.learning.descent import Descent
from fmus.training.learning.lessons import Lessons, lessons
from fmus.training.learning.model import Answer, DrivingModel
from fmus.training.learning.sample import read_sample
from orchestrator.parameters import parameter
from orchestrator.signal import Array


@dataclass(frozen=True, slots=True, kw_only=True)
class BevParameters:
    """Shape of a BEV network, and what its learner pays attention to."""

    keypoints: int = parameter(32, minimum=1, doc="of a message")
    features: int = parameter(256, minimum=2, doc="of a keypoint")
    vectors: int = parameter(16, minimum=1, doc="among the features, vectors in the plane")
    spacing: int = parameter(1, minimum=1, doc="of keypoints, in blocks of 0.8 m")
    hidden: int = parameter(96, minimum=1, doc="units of the encoder")
    fused: int = parameter(96, minimum=1, doc="units of the fusion's first layer")
    pooled: int = parameter(64, minimum=1, doc="units of which the maximum is taken")
    head: int = parameter(64, minimum=1, doc="units of the head")
    cooperative: bool = parameter(default=True, doc="whether it uses messages of others")
    early: bool = parameter(
        default=False, doc="whether others send raw points, laid over the own ones"
    )
    messages: int = parameter(2, minimum=1, maximum=10, doc="of others, used at a time")
    looked_at: int = parameter(
        0, minimum=0, doc="keypoints of every scan, drawn for each batch; 0: all of them"
    )
    yielding_weight: float = parameter(
        8.0, minimum=1.0, doc="of moments in which the expert yields to what the network can see"
    )
    truth_weight: float = parameter(0.3, minimum=0.0, doc="of the loss on what places are")

    @property
    def architecture(self) -> Architecture:
        """Of the network."""
        names = {f.name for f in dataclasses.fields(Architecture)} - {"encoder"}
        return Architecture(**{name: getattr(self, name) for name in names})


class BevLearner(Learner):
    """Learns commands of the expert from keypoints of the BEV encoder, as the radio delivers them.

    In each epoch messages are lost anew, with a rate drawn for each moment. Weights and order of
    the samples depend on the seed, the round and the epoch only.
    """

    Parameters: TypeAlias = BevParameters

    def __init__(
        self, parameters: BevParameters, optimisation: Optimisation, seed: int, device: str
    ) -> None:
        torch.set_num_threads(1)
        self._parameters = parameters
        self._seed = seed
        self._device = torch.device(device)
        self._architecture = parameters.architecture
        torch.manual_seed(seed)
        self._model = DrivingModel(self._architecture).to(self._device)
        self._descent = Descent(self._model, optimisation, seed)
        self._training: Lessons | None = None
        self._validation: Lessons | None = None

    @override
    def add(self, runs: Iterable[RecordedRun]) -> None:
        known = [] if self._training is None else [self._training]
        self._training = Lessons.of([*known, *map(self._lessons, runs)])

    @override
    def add_validation(self, runs: Iterable[RecordedRun]) -> None:
        self._validation = Lessons.of([self._lessons(run) for run in runs])

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
            return self._loss(batch, self._model(batch.seen, batch.ego))

        training = self._descent.epoch(len(known), loss)
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
            weights=self._model.layers.weights(),
            origin={"learner": "bev", "seed": str(self._seed), "round": str(self._descent.round)},
        ).write(path)

    def _lessons(self, run: RecordedRun) -> Lessons:
        rng = np.random.default_rng([self._seed, run.seed])
        return lessons(map(read_sample, run.samples), self._architecture, rng)

    def _batch(self, known: Lessons, rows: Array, rng: np.random.Generator) -> Batch:
        moments = known.moments[rows]
        given = self._parameters
        messages = given.messages if given.cooperative and not given.early else 0
        arrived = delivered(moments, messages, given.keypoints, rng)
        columns = rng.permutation(given.keypoints)[: given.looked_at or given.keypoints]
        return batch_of(known, moments, arrived, columns, self._device)

    def _loss(self, batch: Batch, answer: Answer) -> Tensor:
        given = self._parameters
        imitation = imitation_loss(
            answer.command,
            batch.expert,
            batch.yields,
            batch.sees_threat,
            given.yielding_weight,
        )
        return imitation + given.truth_weight * _truth_loss(batch, answer)

    def _validated(self, known: Lessons) -> tuple[float, dict[str, float]]:
        """Mean loss over all moments and its parts; the same messages are lost every time."""
        rng = np.random.default_rng([self._seed, 1 << 32])
        sums = np.zeros(6)
        with torch.no_grad():
            for first in range(0, len(known), 512):
                rows = np.arange(first, min(first + 512, len(known)))
                batch = self._batch(known, rows, rng)
                answer = self._model(batch.seen, batch.ego)
                errors = (answer.command - batch.expert).abs().mean(dim=0)
                right = ((answer.judgements[..., 0] > 0.0) == batch.vehicle)[batch.there]
                share = right.sum() / max(len(right), 1)
                numbers = [self._loss(batch, answer), *errors, share, _truth_loss(batch, answer)]
                sums += len(rows) * np.array([float(number) for number in numbers])
        means = (sums / len(known)).tolist()
        names = ("accelerate", "brake", "steer", "vehicle", "truth")
        return means[0], dict(zip(names, means[1:], strict=True))


def _truth_loss(batch: Batch, answer: Answer) -> Tensor:
    """On vehicles, moving ones, and their velocities; 0 where there is no place."""
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
