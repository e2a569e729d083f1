"""Conducting a campaign: what is not done yet is done, and everything done is written.

It begins in a directory of its own; after Ctrl-C, which is noticed after every run, it can go on
there.
"""

import abc
import contextlib
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Generic, TypeVar

from tqdm import tqdm

from orchestrator.campaign.journal import Journal
from orchestrator.campaign.work import Result, RunKey, Work
from orchestrator.campaign.workers import Pool, Workers
from orchestrator.errors import CosimError
from orchestrator.run_directory import claim_directory, new_directory

AnyJournal = TypeVar("AnyJournal", bound=Journal[Any])
Outcome = TypeVar("Outcome")


@dataclass(frozen=True, slots=True, kw_only=True)
class Options:
    """How to conduct a campaign.

    Attributes:
        out: the directory of the results; `None`: one of its own in `runs`, numbered.
        pool: opens the workers.
        resume: whether to go on in `out`.
        progress: whether to draw bars.
        command: how the user began this, for the record.
        check: called whenever something is finished; raises `KeyboardInterrupt` if the user asked
            to stop.
    """

    out: Path | None
    pool: Pool
    resume: bool
    progress: bool
    command: str
    check: Callable[[], None]


class Interrupted(KeyboardInterrupt):
    """A campaign was interrupted from outside.

    Attributes:
        outcome: of what was done until then; it is written.
    """

    def __init__(self, outcome: Any) -> None:
        super().__init__("interrupted")
        self.outcome = outcome


class StoppedShortError(CosimError):
    """The machine does not let a campaign go on, as with a full disk; what is finished is kept.

    Attributes:
        directory: of the campaign.
        cause: what the operating system said.
    """

    def __init__(self, directory: Path, cause: OSError) -> None:
        super().__init__(str(cause))
        self.directory = directory
        self.cause = cause


class Campaign(abc.ABC, Generic[AnyJournal, Outcome]):
    """Something that takes hours, and goes on where it was interrupted."""

    @property
    @abc.abstractmethod
    def name(self) -> str:
        """What its directory is called unless the user says otherwise."""

    @abc.abstractmethod
    def begin(self, directory: Path) -> AnyJournal:
        """The journal of a new campaign, in an empty directory."""

    @abc.abstractmethod
    def resume(self, directory: Path) -> AnyJournal:
        """The journal of one that ended early; what failed may be tried again.

        Raises:
            ResumeError: there is none in the directory, or another one.
        """

    @abc.abstractmethod
    def work(self, directory: Path, journal: AnyJournal) -> None:
        """Do what is not done yet."""

    @abc.abstractmethod
    def outcome(self, directory: Path, journal: AnyJournal) -> Outcome:
        """Write what was found until now, and say what it is."""


def conduct(campaign: Campaign[AnyJournal, Outcome], options: Options) -> Outcome:
    """Do what is not done yet, and write what was found.

    Raises:
        RecordingError, ResumeError: the directory cannot be used.
        Interrupted: after Ctrl-C; what was done is written.
        StoppedShortError: a file could not be written or read.
    """
    if options.resume and options.out is not None:
        directory, enter = options.out, campaign.resume
    else:
        directory, enter = _directory(options.out, campaign.name), campaign.begin
    journal = enter(directory)
    try:
        with contextlib.closing(journal):
            return _conducted(campaign, directory, journal)
    except OSError as error:  # closing writes, too
        raise StoppedShortError(directory, error) from error


def _conducted(
    campaign: Campaign[AnyJournal, Outcome], directory: Path, journal: AnyJournal
) -> Outcome:
    try:
        campaign.work(directory, journal)
    except KeyboardInterrupt:
        raise Interrupted(campaign.outcome(directory, journal)) from None
    return campaign.outcome(directory, journal)


def _directory(out: Path | None, name: str) -> Path:
    return new_directory(Path("runs"), name) if out is None else claim_directory(out)


def perform_all(
    work: Sequence[tuple[RunKey, Work]],
    workers: Workers,
    note: Callable[[RunKey, Result], None],
    options: Options,
    *,
    done: int,
    label: str | None = None,
) -> None:
    """Perform runs, and note each as it comes.

    Args:
        work: what is to be done.
        workers: who does it.
        note: called with the result of every run.
        options: say whether there is a bar, and notice the user's wish to stop.
        done: how many runs the bar counts as done at first.
        label: in front of the bar.
    """
    bar = tqdm(
        total=len(work) + done,
        initial=done,
        desc=label,
        file=sys.stderr,
        unit=" runs",
        smoothing=0.0,  # runs take turns and cost differently: the mean says what is left
        disable=not options.progress,
    )
    with bar, contextlib.closing(workers.results(work)) as results:
        for key, result in results:
            bar.update()
            note(key, result)
            options.check()
