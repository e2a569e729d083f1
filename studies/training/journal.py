"""What is known of a training that is under way.

training.json   what the training is
provenance.json of every start: command, commit, versions, host, device
journal.jsonl   one line of JSON per finished run, phase, epoch and round
"""

import logging
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final, TypeAlias

from typing_extensions import override

from orchestrator.campaign import journal
from orchestrator.campaign.journal import Identity, Kind, ResumeError, session
from orchestrator.campaign.work import Result
from studies.training.encounters import Encounter
from studies.training.learner import EpochResult
from studies.training.plan import Training

logger = logging.getLogger(__name__)

IDENTITY: Final = "training.json"
PROVENANCE: Final = "provenance.json"
ENTRIES: Final = "journal.jsonl"

KIND: Final = Kind(
    noun="training",
    identity=IDENTITY,
    sessions=PROVENANCE,
    entries=ENTRIES,
    ordered=True,
    growing="rounds",
    names={},
    remarks={"commit": "was begun with the commit", "device": "was begun with the device"},
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Run:
    """A finished run.

    Attributes:
        phase: its name.
        seed: of the run.
        samples: how many there were.
        result: what became of it.
    """

    phase: str
    seed: int
    samples: int
    result: Result


@dataclass(frozen=True, slots=True, kw_only=True)
class PhaseEnd:
    """A phase whose runs are all finished; failed ones are left out for good.

    Attributes:
        phase: its name.
    """

    phase: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Epoch:
    """A finished epoch.

    Attributes:
        round: 0 for behaviour cloning, then those of DAgger.
        epoch: counted from 1 in each round.
        result: what it came to.
        seconds: how long it took [s].
    """

    round: int
    epoch: int
    result: EpochResult
    seconds: float


@dataclass(frozen=True, slots=True, kw_only=True)
class RoundEnd:
    """A finished round, whose network is in `rounds`.

    Attributes:
        round: its number.
        best: the epoch with the lowest validation loss, whose weights are kept.
    """

    round: int
    best: int


Entry: TypeAlias = Run | PhaseEnd | Epoch | RoundEnd
_KINDS: Final[Mapping[str, type[Entry]]] = {
    "run": Run,
    "phase": PhaseEnd,
    "epoch": Epoch,
    "round": RoundEnd,
}


class Journal(journal.Journal[Entry]):
    """The finished parts of a training.

    Attributes:
        runs: by phase and seed; of failed ones the last attempt.
        phases: names of the finished phases.
        epochs: of each round, in order.
        rounds: of the finished rounds the best epoch.
    """

    def __init__(self, directory: Path, entries: Sequence[Entry]) -> None:
        self.runs: dict[tuple[str, int], Run] = {}
        self.phases: list[str] = []
        self.epochs: defaultdict[int, list[Epoch]] = defaultdict(list)
        self.rounds: dict[int, int] = {}
        super().__init__(directory / ENTRIES, entries)

    @classmethod
    def begin(cls, directory: Path, training: Training, command: str, device: str) -> "Journal":
        """The journal of a new training, in an empty directory.

        Args:
            directory: of the results.
            training: that begins.
            command: that began it, for the record.
            device: on which it learns, for the record.
        """
        _identity(training).begin(directory, _session(training, command, device))
        return cls(directory, [])

    @classmethod
    def resume(cls, directory: Path, training: Training, command: str, device: str) -> "Journal":
        """The journal of a training that ended early.

        Failed runs of unfinished phases count as not done.

        Args:
            directory: of the results.
            training: that goes on.
            command: that goes on with it, for the record.
            device: on which it learns, for the record.

        Raises:
            ResumeError: there is no training, or another one.
        """
        identity = _identity(training)
        former = identity.former(directory)
        entries = list(_entries(directory / ENTRIES, former.lines))
        _check_rounds(directory, training, entries)
        identity.go_on(directory, former, _session(training, command, device))
        closed = {entry.phase for entry in entries if isinstance(entry, PhaseEnd)}
        return cls(directory, [entry for entry in entries if not _is_to_repeat(entry, closed)])

    def failed(self) -> list[Run]:
        """The runs that failed twice."""
        return [run for run in self.runs.values() if run.result.error is not None]

    @override
    def _note(self, entry: Entry) -> None:
        match entry:
            case Run():
                self.runs[entry.phase, entry.seed] = entry
            case PhaseEnd():
                self.phases.append(entry.phase)
            case Epoch():
                self.epochs[entry.round].append(entry)
            case RoundEnd():
                self.rounds[entry.round] = entry.best

    @override
    def _content(self, entry: Entry) -> Mapping[str, Any]:
        (kind,) = (name for name, each in _KINDS.items() if isinstance(entry, each))
        return {"kind": kind, **asdict(entry)}


def _is_to_repeat(entry: Entry, closed: set[str]) -> bool:
    if not isinstance(entry, Run):
        return False
    return entry.result.error is not None and entry.phase not in closed


def _entries(path: Path, lines: Sequence[dict[str, Any]]) -> Iterator[Entry]:
    """Lines read again, until one is damaged."""
    for content in lines:
        try:
            yield _entry(content)
        except (KeyError, TypeError):
            logger.warning("a line of `%s` is damaged, and left out with all behind it", path)
            return


def _entry(content: dict[str, Any]) -> Entry:
    """A line read again."""
    kind = _KINDS[content.pop("kind")]
    if kind is Run:
        content["result"] = Result(**content["result"])
    if kind is Epoch:
        content["result"] = EpochResult(**content["result"])
    return kind(**content)


def _identity(training: Training) -> Identity:
    return Identity(
        kind=KIND,
        fixed={
            "seed": training.seed,
            "network": training.network,
            "scenes": [each.scenes for each in training.encounters],
            "encounters": [_described(each) for each in training.encounters],
            "held_out": [_described(each) for each in training.held_out],
            "expert": {"runs": training.expert_runs, "seed": training.expert_seed},
            "dagger": {"runs": training.round_runs, "beta": training.beta, "decay": training.decay},
            "validation": {"runs": training.validation_runs, "drives": training.drives},
            "optimisation": asdict(training.optimisation),
            "scenario": [each.resolved for each in training.encounters],
        },
        growing={"rounds": training.rounds, "evaluation": {"runs": training.evaluation_runs}},
    )


def _described(encounter: Encounter) -> dict[str, Any]:
    return {
        "name": encounter.name,
        "weight": encounter.weight,
        "set": encounter.settings,
        "scenes": encounter.scenes,
    }


def _check_rounds(directory: Path, training: Training, entries: Sequence[Entry]) -> None:
    done = max((e.round for e in entries if isinstance(e, Epoch | RoundEnd)), default=0)
    if done > training.rounds:
        raise ResumeError(
            f"`{directory}` holds {done} rounds of DAgger; the file has {training.rounds} now, "
            "but rounds can only be added"
        )


def _session(training: Training, command: str, device: str) -> dict[str, Any]:
    return session(command, file=str(training.path), device=device)
