"""Driving: the runs of a phase, on all workers, and the samples that they leave."""

import contextlib
import logging
import shlex
import shutil
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

from orchestrator.campaign.conduct import Options, perform_all
from orchestrator.campaign.work import Result, RunKey, Work
from orchestrator.campaign.workers import Workers
from orchestrator.errors import CosimError
from studies.training import files
from studies.training.collection import Collection
from studies.training.journal import Journal, PhaseEnd, Run
from studies.training.learner import RecordedRun
from studies.training.plan import Phase, Training, driver_texts
from studies.training.samples import read_samples, recorded_samples, write_samples

logger = logging.getLogger(__name__)

RUNS, SAMPLES, ROUNDS = "runs", "samples", "rounds"
"""Folders: of run directories that are in use or failed, of samples, of the networks of rounds."""

MOST_FAILED: Final = 0.1
"""The share of a phase's runs that may fail; more is no accident."""


class TrainingFailedError(CosimError):
    """Too many runs failed, or they have nothing to teach. Exit code 3."""


@dataclass(frozen=True, slots=True)
class Rollouts:
    """The driving part of a training.

    Args:
        training: what is driven.
        directory: of the results.
        journal: knows what is done, and is told.
        options: how; between phases of driving the workers are closed, for the learner.
        collection: of the expert's runs; `None`: all are driven.
    """

    training: Training
    directory: Path
    journal: Journal
    options: Options
    collection: Collection | None = None

    def drive(self, *phases: Phase) -> None:
        """Do the runs of these phases that are not done yet.

        Raises:
            TrainingFailedError: more than `MOST_FAILED` of a phase failed, or it has no samples.
        """
        phases = tuple(phase for phase in phases if not self._is_over(phase))
        for phase in phases:
            self._take(phase)
        if any(self._missing(phase) for phase in phases):
            with self.options.pool() as workers:
                for phase in phases:
                    self._drive(phase, workers)
        for phase in phases:
            self._check(phase)
            self.journal.add(PhaseEnd(phase=phase.name))
        with contextlib.suppress(OSError):  # run directories that failed stay
            (self.directory / RUNS).rmdir()

    def recorded(self, phase: Phase) -> Iterator[RecordedRun]:
        """The runs of a finished phase, in the order of their seeds, failed ones left out."""
        for seed in phase.seeds:
            if self.journal.runs[phase.name, seed].result.error is None:
                yield RecordedRun(
                    seed=seed,
                    levels=self.training.scene(phase, seed),
                    samples=read_samples(self._samples(phase.name, seed)),
                )

    def network(self, number: int) -> Path:
        """The checkpoint of a round."""
        return self.directory / ROUNDS / f"round-{number}.safetensors"

    def command(self, run: Run, phase: Phase) -> str:
        """The shell command that repeats a run."""
        words = ["nlosim", "run", str(self.training.encounter(phase, run.seed).scenario)]
        for override in self._overrides(phase, run.seed):
            words += ["--set", override]
        return shlex.join(words)

    def _is_over(self, phase: Phase) -> bool:
        """Whether nothing is left to do; runs may have been added to an evaluation."""
        return phase.name in self.journal.phases and not self._missing(phase)

    def _missing(self, phase: Phase) -> list[int]:
        return [seed for seed in phase.seeds if (phase.name, seed) not in self.journal.runs]

    def _take(self, phase: Phase) -> None:
        """Take the runs of a phase that are in the collection."""
        if self.collection is None or phase.driver is not None:
            return
        for seed in self._missing(phase):
            stored = self.collection.find(self.collection.key(self._work(phase, seed)))
            if stored is None:
                continue
            files.write(self._samples(phase.name, seed), stored.samples.read_bytes())
            run = Run(phase=phase.name, seed=seed, samples=stored.count, result=stored.result)
            self.journal.add(run)
            logger.info("%s, seed %d: was driven before", phase.name, seed)
            self.options.check()

    def _drive(self, phase: Phase, workers: Workers) -> None:
        missing = self._missing(phase)
        work = [(RunKey(seed, 0), self._work(phase, seed)) for seed in missing]

        def note(key: RunKey, result: Result) -> None:
            self.journal.add(self._collected(phase, key.seed, result))
            end = "done" if result.error is None else f"failed twice: {result.error}"
            logger.info("%s, seed %d: %s, %.1f s", phase.name, key.seed, end, result.wall)

        done = len(phase.seeds) - len(missing)
        perform_all(work, workers, note, self.options, done=done, label=phase.name)

    def _work(self, phase: Phase, seed: int) -> Work:
        folder = self._folder(phase, seed)
        shutil.rmtree(folder, ignore_errors=True)  # of a run that was interrupted or failed
        return Work(
            scenario=str(self.training.encounter(phase, seed).scenario),
            overrides=self._overrides(phase, seed),
            keep=str((folder / "attempt").absolute()),
            scratch=None,
        )

    def _overrides(self, phase: Phase, seed: int) -> tuple[str, ...]:
        network = None if phase.driver is None else self.network(phase.driver)
        encounter = self.training.encounter(phase, seed)
        scene = encounter.overrides(encounter.levels(seed))
        return (*scene, *driver_texts(encounter.users, network, phase.beta), f"seed={seed}")

    def _folder(self, phase: Phase, seed: int) -> Path:
        """The folder of a run; it has one for each attempt."""
        return self.directory / RUNS / f"{phase.name}-{seed}"

    def _samples(self, phase: str, seed: int) -> Path:
        return self.directory / SAMPLES / f"{phase}-{seed}.npz"

    def _collected(self, phase: Phase, seed: int, result: Result) -> Run:
        """A finished run, its samples stored and its recording removed."""
        run = Run(phase=phase.name, seed=seed, samples=0, result=result)
        if result.error is not None:
            return run
        folder = self._folder(phase, seed)
        last = max(folder.iterdir(), key=lambda path: len(path.name))  # attempt, attempt-2
        samples = recorded_samples(last)
        if phase.is_lesson:
            write_samples(self._samples(phase.name, seed), samples)
        shutil.rmtree(folder)
        if self.collection is not None and phase.driver is None:
            key = self.collection.key(self._work(phase, seed))
            self.collection.keep(key, self._samples(phase.name, seed), len(samples), result)
        return replace(run, samples=len(samples))

    def _check(self, phase: Phase) -> None:
        runs = [self.journal.runs[phase.name, seed] for seed in phase.seeds]
        failed = [run for run in runs if run.result.error is not None]
        if len(failed) > MOST_FAILED * len(runs):
            raise TrainingFailedError(
                f"{len(failed)} of {len(runs)} runs of the phase `{phase.name}` failed, the first "
                f"with: {failed[0].result.error}\n"
                f"repeat it with: {self.command(failed[0], phase)}"
            )
        if phase.is_lesson and not any(run.samples for run in runs):
            raise TrainingFailedError(
                f"the runs of the phase `{phase.name}` have no samples to learn from: "
                "`policy.sample` was empty all the time"
            )
