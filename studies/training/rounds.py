"""Learning: the epochs of a round, until the validation loss does not fall any more."""

import logging
import math
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from tqdm import tqdm

from orchestrator.campaign.conduct import Options
from orchestrator.errors import CosimError
from studies.training import files
from studies.training.journal import Epoch, Journal, RoundEnd
from studies.training.learner import EpochResult, Learner, RecordedRun, create_learner
from studies.training.plan import Phase, Training
from studies.training.rollouts import Rollouts

logger = logging.getLogger(__name__)

STATES: Final = "states"
"""The folder of the learner's states: of the newest epoch, and of the best one of each round."""


class LearningError(CosimError):
    """The learner cannot go on with what the training file asks for. Exit code 2."""


@dataclass(frozen=True, slots=True)
class States:
    """The learner's states after epochs, on the disk.

    Attributes:
        directory: of the results.
    """

    directory: Path

    def write(self, number: int, epoch: int, state: bytes) -> None:
        """Write a state; when this returns, it is on the disk."""
        files.write(self._path(number, epoch), state)

    def read(self, number: int, epoch: int) -> bytes:
        """Read a state.

        Raises:
            LearningError: it is gone.
        """
        try:
            return self._path(number, epoch).read_bytes()
        except OSError as error:
            what = f"{self._path(number, epoch)} cannot be read: {error.strerror}"
            raise LearningError(f"{what}; begin anew with another --out") from None

    def keep(self, number: int, epochs: set[int]) -> None:
        """Remove all states of the round `number` but these."""
        kept = {self._path(number, epoch) for epoch in epochs}
        for path in set((self.directory / STATES).glob(f"round-{number}-epoch-*")) - kept:
            path.unlink()

    def _path(self, number: int, epoch: int) -> Path:
        return self.directory / STATES / f"round-{number}-epoch-{epoch}"


def best(epochs: Sequence[Epoch]) -> int:
    """The epoch of the lowest validation loss, the first if there are several."""
    return min(epochs, key=lambda each: (each.result.validation, each.epoch)).epoch


def is_over(epochs: Sequence[Epoch], limit: int, patience: int) -> bool:
    """Whether a round with these epochs has come to its end.

    Args:
        epochs: until now.
        limit: how many there are at most.
        patience: epochs without a better validation loss that end it earlier.
    """
    return bool(epochs) and (len(epochs) >= limit or len(epochs) - best(epochs) >= patience)


class Rounds:
    """The learning part of a training.

    Args:
        training: what is learned.
        directory: of the results.
        journal: knows what is done, and is told.
        rollouts: has the runs of finished phases.
        device: `cpu` or `cuda`.
        options: whether to draw bars, and what notices the user's wish to stop.
    """

    def __init__(
        self,
        training: Training,
        directory: Path,
        journal: Journal,
        rollouts: Rollouts,
        *,
        device: str,
        options: Options,
    ) -> None:
        self._training = training
        self._journal = journal
        self._rollouts = rollouts
        self._states = States(directory)
        self._device = device
        self._options = options
        self._learner: Learner | None = None
        self._taught = 0
        """Rounds whose runs the learner has."""

    def learn(self, number: int) -> None:
        """Do what is left of a round, and write its network.

        Raises:
            LearningError: a sample is not one of the learner's, or a loss is not finite.
        """
        if number in self._journal.rounds:
            return
        learner = self._prepared(number)
        epochs = self._journal.epochs[number]
        if epochs:
            self._restore(learner, number, epochs[-1].epoch)
        self._epochs(learner, number)
        chosen = best(epochs)
        self._restore(learner, number, chosen)
        path = self._rollouts.network(number)
        path.parent.mkdir(exist_ok=True)
        draft = path.with_name(f"draft-{path.name}")
        learner.export(draft)
        files.settle(draft, path)
        self._journal.add(RoundEnd(round=number, best=chosen))
        self._states.keep(number, {chosen})

    def _epochs(self, learner: Learner, number: int) -> None:
        epochs, plan = self._journal.epochs[number], self._training.optimisation
        bar = tqdm(
            total=plan.epochs,
            initial=len(epochs),
            desc=f"round {number}",
            file=sys.stderr,
            unit=" epochs",
            disable=not self._options.progress,
        )
        with bar:
            while not is_over(epochs, plan.epochs, plan.patience):
                epoch = self._epoch(learner, number, len(epochs) + 1)
                self._states.write(number, epoch.epoch, learner.state())
                self._journal.add(epoch)
                self._states.keep(number, {epoch.epoch, best(epochs)})
                losses = f"training {epoch.result.training:.4g}, "
                losses += f"validation {epoch.result.validation:.4g}"
                bar.set_postfix_str(losses, refresh=False)
                bar.update()
                logger.info("round %d, epoch %d: %s", number, epoch.epoch, losses)
                self._options.check()

    def _epoch(self, learner: Learner, number: int, epoch: int) -> Epoch:
        begin = time.perf_counter()
        result = learner.epoch()
        for name, value in named_losses(result).items():
            if not math.isfinite(value):
                what = f"`{name}` is {value} after epoch {epoch} of round {number}"
                raise LearningError(f"{what}; a lower `optimisation.rate` may help")
        seconds = time.perf_counter() - begin
        return Epoch(round=number, epoch=epoch, result=result, seconds=seconds)

    def _prepared(self, number: int) -> Learner:
        """The learner at the beginning of a round, with all runs until then.

        What is done here does not depend on how often the training was interrupted.
        """
        learner = self._learner
        if learner is None:
            learner = self._learner = self._created()
            self._teach(learner.add_validation, self._training.validation())
        while self._taught <= number:
            self._teach(learner.add, self._training.lessons(self._taught))
            self._taught += 1
        if number > 0:
            self._restore(learner, number - 1, self._journal.rounds[number - 1])
        learner.begin_round(number)
        return learner

    def _created(self) -> Learner:
        plan = self._training
        try:
            return create_learner(
                plan.learner, plan.parameters, plan.optimisation, plan.seed, self._device
            )
        except (ValueError, ImportError) as error:
            raise LearningError(f"the learner `{plan.learner_name}`: {error}") from error

    def _teach(self, add: Callable[[Iterable[RecordedRun]], None], phase: Phase) -> None:
        try:
            add(self._watched(phase))
        except (ValueError, OSError) as error:
            what = f"samples of the phase `{phase.name}` cannot be learned from: {error}"
            raise LearningError(what) from error

    def _watched(self, phase: Phase) -> Iterator[RecordedRun]:
        """The runs of a phase as they are taken in, which takes minutes where they are many."""
        bar = tqdm(
            self._rollouts.recorded(phase),
            total=len(phase.seeds),
            desc=f"taking in {phase.name}",
            file=sys.stderr,
            unit=" runs",
            leave=False,
            disable=not self._options.progress,
        )
        for run in bar:
            self._options.check()
            yield run

    def _restore(self, learner: Learner, number: int, epoch: int) -> None:
        try:
            learner.restore(self._states.read(number, epoch))
        except ValueError as error:
            what = f"the state after epoch {epoch} of round {number} cannot be read: {error}"
            raise LearningError(what) from error


def named_losses(result: EpochResult) -> dict[str, float]:
    """All numbers of an epoch by the names of their columns."""
    return {
        "training_loss": result.training,
        "validation_loss": result.validation,
        **result.parts,
    }
