"""Conducting a training: driving and learning by turns; what is done already is not done again."""

import logging
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from typing_extensions import override

from orchestrator.campaign.conduct import Campaign, Options, conduct
from orchestrator.log import run_log
from studies.training import figure, files, results
from studies.training.collection import Collection
from studies.training.device import resolve
from studies.training.journal import Journal, Run
from studies.training.plan import Training
from studies.training.results import Findings
from studies.training.rollouts import Rollouts, TrainingFailedError
from studies.training.rounds import Rounds

logger = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True, kw_only=True)
class TrainingOutcome:
    """What a training came to.

    Attributes:
        directory: of the results.
        findings: rows of the tables.
        summary: the tables, for people.
        failed: runs that failed twice, and the commands that repeat them.
        error: why it ended early, if it did.
    """

    directory: Path
    findings: Findings
    summary: str
    failed: list[tuple[Run, str]]
    error: TrainingFailedError | None


def conduct_training(
    training: Training, options: Options, collection: Collection | None = None
) -> TrainingOutcome:
    """Do what is not done yet; write tables, figure and, at the end, the checkpoint.

    Args:
        training: that is conducted.
        options: how.
        collection: of runs of the expert that need not be driven again; `None`: all are.

    Raises:
        DeviceError: there is no such device here.
        LearningError: the learner cannot go on.
        RecordingError, ResumeError: the directory cannot be used.
        Interrupted: after Ctrl-C; what was done is written.
        StoppedShortError: a file could not be written or read.
    """
    lessons = _Lessons(training, options, resolve(training.device), collection)
    return conduct(lessons, options)


@dataclass(slots=True)
class _Lessons(Campaign[Journal, TrainingOutcome]):
    """Driving and learning, round by round."""

    training: Training
    options: Options
    device: str
    collection: Collection | None = None
    error: TrainingFailedError | None = None

    @property
    @override
    def name(self) -> str:
        return f"train-{self.training.path.stem}"

    @override
    def begin(self, directory: Path) -> Journal:
        return Journal.begin(directory, self.training, self.options.command, self.device)

    @override
    def resume(self, directory: Path) -> Journal:
        return Journal.resume(directory, self.training, self.options.command, self.device)

    @override
    def work(self, directory: Path, journal: Journal) -> None:
        rollouts = Rollouts(self.training, directory, journal, self.options, self.collection)
        rounds = Rounds(
            self.training, directory, journal, rollouts, device=self.device, options=self.options
        )
        with run_log(directory, echo=False):
            try:
                for number in _rounds(self.training, rollouts, rounds):
                    logger.info("round %d is done", number)
                    _write(self.training, rollouts)
                _publish(self.training, rollouts)
                self._evaluate(rollouts)
            except TrainingFailedError as reason:
                logger.info("%s", reason)
                self.error = reason

    def _evaluate(self, rollouts: Rollouts) -> None:
        """Let the chosen network drive in every encounter, and where it never learned."""
        number = results.chosen_round(self.training, rollouts.journal)
        phases = [] if number is None else self.training.evaluation(number)
        if phases:
            rollouts.drive(*phases)

    @override
    def outcome(self, directory: Path, journal: Journal) -> TrainingOutcome:
        rollouts = Rollouts(self.training, directory, journal, self.options)
        found, summary = _write(self.training, rollouts)
        chosen = [] if found.chosen is None else self.training.evaluation(found.chosen)
        phases = {phase.name: phase for phase in (*self.training.phases(), *chosen)}
        return TrainingOutcome(
            directory=directory,
            findings=found,
            summary=summary,
            failed=[(run, rollouts.command(run, phases[run.phase])) for run in journal.failed()],
            error=self.error,
        )


def _rounds(training: Training, rollouts: Rollouts, rounds: Rounds) -> Iterator[int]:
    """Drive and learn, round by round."""
    rollouts.drive(training.validation(), training.lessons(0))
    for number in range(training.rounds + 1):
        rollouts.drive(training.lessons(number))
        rounds.learn(number)
        if training.drives:
            rollouts.drive(training.drive(number))
        yield number


def _publish(training: Training, rollouts: Rollouts) -> None:
    """Put the network of the chosen round where the training file says."""
    number = results.chosen_round(training, rollouts.journal)
    if number is not None:
        files.write(training.checkpoint, rollouts.network(number).read_bytes())


def _write(training: Training, rollouts: Rollouts) -> tuple[Findings, str]:
    found = results.findings(training, rollouts.journal)
    summary = results.write(rollouts.directory, found)
    figure.draw(found, rollouts.directory)
    return found, summary
