"""Conducting a training: driving and learning by turns; what is done already is not done again."""

import contextlib
import logging
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from orchestrator.log import run_log
from orchestrator.run import claim_directory, new_directory
from studies.training import figure, files, results
from studies.training.device import resolve
from studies.training.journal import Journal, Run
from studies.training.plan import Training
from studies.training.results import Findings
from studies.training.rollouts import Pool, Rollouts, TrainingFailedError
from studies.training.rounds import Rounds

logger = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True, kw_only=True)
class Options:
    """How to conduct a training.

    Attributes:
        out: the directory of the results; `None`: `runs/train-NAME`, numbered.
        pool: opens the workers of a phase of driving.
        resume: whether to go on in `out`.
        progress: whether to draw bars.
        command: how the user began this, for the record.
        check: called after every run and epoch; raises `KeyboardInterrupt` if the user asked to
            stop.
    """

    out: Path | None
    pool: Pool
    resume: bool
    progress: bool
    command: str
    check: Callable[[], None]


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


class TrainingInterrupted(KeyboardInterrupt):
    """A training was interrupted from outside.

    Attributes:
        outcome: of what was done until then; it is written.
    """

    def __init__(self, outcome: TrainingOutcome) -> None:
        super().__init__("interrupted")
        self.outcome = outcome


def conduct(training: Training, options: Options) -> TrainingOutcome:
    """Do what is not done yet; write tables, figure and, at the end, the checkpoint.

    Raises:
        DeviceError: there is no such device here.
        LearningError: the learner cannot go on.
        RecordingError, ResumeError: the directory cannot be used.
        TrainingInterrupted: after Ctrl-C; what was done is written.
    """
    device = resolve(training.device)
    directory, journal = _journal(training, options, device)
    rollouts = Rollouts(training, directory, journal, options.pool, options.check, options.progress)
    rounds = Rounds(
        training,
        directory,
        journal,
        rollouts,
        device=device,
        check=options.check,
        progress=options.progress,
    )
    error = None
    with contextlib.closing(journal), run_log(directory, echo=False):
        try:
            for number in _rounds(training, rollouts, rounds):
                logger.info("round %d is done", number)
                _write(training, rollouts)
            _publish(training, rollouts)
        except KeyboardInterrupt:
            raise TrainingInterrupted(_outcome(training, rollouts, None)) from None
        except TrainingFailedError as reason:
            logger.info("%s", reason)
            error = reason
        return _outcome(training, rollouts, error)


def _journal(training: Training, options: Options, device: str) -> tuple[Path, Journal]:
    if options.resume and options.out is not None:
        return options.out, Journal.resume(options.out, training, options.command, device)
    if options.out is None:
        directory = new_directory(Path("runs"), f"train-{training.path.stem}")
    else:
        directory = claim_directory(options.out)
    return directory, Journal.begin(directory, training, options.command, device)


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


def _outcome(
    training: Training, rollouts: Rollouts, error: TrainingFailedError | None
) -> TrainingOutcome:
    found, summary = _write(training, rollouts)
    phases = {phase.name: phase for phase in training.phases()}
    failed = [(run, rollouts.command(run, phases[run.phase])) for run in rollouts.journal.failed()]
    return TrainingOutcome(
        directory=rollouts.directory,
        findings=found,
        summary=summary,
        failed=failed,
        error=error,
    )
