"""What is known of a training that is under way, safe against its sudden end.

training.json   what the training is; a resumed one must be the same
provenance.json of every start: command, commit, versions, host, device
journal.jsonl   one line of JSON per finished run, phase, epoch and round, in the order of finishing
"""

import json
import logging
import os
from collections import defaultdict
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final, TextIO, TypeAlias

from orchestrator.errors import CosimError
from orchestrator.experiment.work import Result
from orchestrator.machine import commit, cpu, memory_gib
from orchestrator.provenance import nlosim_version, provenance
from orchestrator.recording.layout import write_json
from studies.training.learner import EpochResult
from studies.training.plan import Training

logger = logging.getLogger(__name__)

IDENTITY: Final = "training.json"
PROVENANCE: Final = "provenance.json"
ENTRIES: Final = "journal.jsonl"


class ResumeError(CosimError):
    """The directory holds no training, or another one. Exit code 2."""


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


class Journal:
    """The finished parts of a training.

    Attributes:
        runs: by phase and seed; of failed ones the last attempt.
        phases: names of the finished phases.
        epochs: of each round, in order.
        rounds: of the finished rounds the best epoch.
    """

    def __init__(self, directory: Path, entries: list[Entry]) -> None:
        self.runs: dict[tuple[str, int], Run] = {}
        self.phases: list[str] = []
        self.epochs: defaultdict[int, list[Epoch]] = defaultdict(list)
        self.rounds: dict[int, int] = {}
        for entry in entries:
            self._note(entry)
        draft = directory / f"{ENTRIES}.draft"
        draft.write_text("".join(map(_line, entries)), encoding="utf-8")
        draft.replace(directory / ENTRIES)  # without the half line of a sudden end
        self._file: TextIO = (directory / ENTRIES).open("a", encoding="utf-8")

    @classmethod
    def begin(cls, directory: Path, training: Training, command: str, device: str) -> "Journal":
        """The journal of a new training, in an empty directory.

        Args:
            directory: of the results.
            training: that begins.
            command: that began it, for the record.
            device: on which it learns, for the record.
        """
        write_json(directory / IDENTITY, identity(training))
        _write_sessions(directory, [_session(training, command, device)])
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
        try:
            known = json.loads((directory / IDENTITY).read_text(encoding="utf-8"))
            sessions = json.loads((directory / PROVENANCE).read_text(encoding="utf-8"))["sessions"]
            lines = (directory / ENTRIES).read_text(encoding="utf-8").splitlines()
        except (OSError, ValueError, KeyError) as error:
            what = f"`{directory}` holds no training to resume; leave `--resume` out"
            raise ResumeError(what) from error
        entries = [entry for line in lines if (entry := _entry(line)) is not None]
        _check(directory, known, training, entries)
        sessions.append(_session(training, command, device))
        _warn(directory, sessions)
        write_json(directory / IDENTITY, identity(training))
        _write_sessions(directory, sessions)
        closed = {entry.phase for entry in entries if isinstance(entry, PhaseEnd)}
        return cls(directory, [entry for entry in entries if not _is_to_repeat(entry, closed)])

    def add(self, entry: Entry) -> None:
        """Note what is finished; when this returns, it is on the disk."""
        self._note(entry)
        self._file.write(_line(entry))
        self._file.flush()
        os.fsync(self._file.fileno())

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    def failed(self) -> list[Run]:
        """The runs that failed twice."""
        return [run for run in self.runs.values() if run.result.error is not None]

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


def _is_to_repeat(entry: Entry, closed: set[str]) -> bool:
    if not isinstance(entry, Run):
        return False
    return entry.result.error is not None and entry.phase not in closed


def _line(entry: Entry) -> str:
    (kind,) = (name for name, each in _KINDS.items() if isinstance(entry, each))
    return json.dumps({"kind": kind, **asdict(entry)}, allow_nan=False) + "\n"


def _entry(line: str) -> Entry | None:
    """A line read again; `None` for one that was being written when everything ended."""
    try:
        content = json.loads(line)
    except ValueError:
        return None
    kind = _KINDS[content.pop("kind")]
    if kind is Run:
        content["result"] = Result(**content["result"])
    if kind is Epoch:
        content["result"] = EpochResult(**content["result"])
    return kind(**content)


def identity(training: Training) -> dict[str, Any]:
    """What must not change while a training is under way, and `rounds`, which may grow."""
    content = {
        "nlosim": nlosim_version(),
        "seed": training.seed,
        "network": training.network,
        "scenes": training.scenes,
        "expert": {"runs": training.expert_runs},
        "dagger": {"runs": training.round_runs, "beta": training.beta, "decay": training.decay},
        "validation": {"runs": training.validation_runs, "drives": training.drives},
        "optimisation": asdict(training.optimisation),
        "scenario": training.resolved,
        "rounds": training.rounds,
    }
    plain: dict[str, Any] = json.loads(json.dumps(content))  # tuples become lists
    return plain


def _check(
    directory: Path, known: Mapping[str, Any], training: Training, entries: list[Entry]
) -> None:
    new = identity(training)
    changed = [key for key in new if key != "rounds" and new[key] != known.get(key)]
    if changed:
        what = "the version of nlosim" if changed[0] == "nlosim" else f"`{changed[0]}`"
        raise ResumeError(
            f"`{directory}` holds another training: {what} changed since; only rounds may be "
            "added. Choose another --out, without --resume"
        )
    done = max((e.round for e in entries if isinstance(e, Epoch | RoundEnd)), default=0)
    if done > training.rounds:
        raise ResumeError(
            f"`{directory}` holds {done} rounds of DAgger; the file has {training.rounds} now, "
            "but rounds can only be added"
        )


def _session(training: Training, command: str, device: str) -> dict[str, Any]:
    """Where the results of one start come from."""
    origin = provenance()
    host = {**origin["host"], "cpu": cpu(), "memory_gib": memory_gib()}
    where = {"command": command, "file": str(training.path), "device": device}
    return {**where, "commit": commit(), **origin, "host": host}


def _write_sessions(directory: Path, sessions: list[dict[str, Any]]) -> None:
    write_json(directory / PROVENANCE, {"sessions": sessions})


def _warn(directory: Path, sessions: list[dict[str, Any]]) -> None:
    """Say that the result is about to come from two states of the code, or two devices."""
    former, now = sessions[-2:]
    for key in ("commit", "device"):
        if former[key] != now[key]:
            what = "`%s` was begun with the %s %s; going on with %s, whose results may differ"
            logger.warning(what, directory, key, former[key] or "unknown", now[key] or "unknown")
