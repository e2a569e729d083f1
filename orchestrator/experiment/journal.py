"""What is known of an experiment that is under way, safe against its sudden end.

experiment.json   what the experiment is; a resumed one must be the same
runs.jsonl        one line of JSON per finished run, with all its metrics, in the order of finishing
"""

import json
import logging
import os
from collections.abc import Collection, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any, Final, TextIO

from orchestrator.errors import CosimError
from orchestrator.experiment.plan import Experiment, RunKey
from orchestrator.experiment.work import Result
from orchestrator.machine import commit, cpu, memory_gib
from orchestrator.provenance import nlosim_version, provenance
from orchestrator.recording.layout import write_json

logger = logging.getLogger(__name__)

IDENTITY: Final = "experiment.json"
RUNS: Final = "runs.jsonl"


class ResumeError(CosimError):
    """The directory holds no experiment, or another one. Exit code 2."""


class Journal:
    """The finished runs of an experiment.

    Attributes:
        results: by run; of failed ones the last attempt.
    """

    def __init__(self, directory: Path, results: Mapping[RunKey, Result]) -> None:
        self.results = dict(results)
        draft = directory / f"{RUNS}.draft"
        draft.write_text("".join(map(_line, results, results.values())), encoding="utf-8")
        draft.replace(directory / RUNS)  # without the half line of a sudden end
        self._file: TextIO = (directory / RUNS).open("a", encoding="utf-8")

    @classmethod
    def begin(cls, directory: Path, experiment: Experiment, command: str) -> "Journal":
        """The journal of a new experiment, in an empty directory.

        Args:
            directory: of the results.
            experiment: that begins.
            command: that began it, for the record.
        """
        content = {**_identity(experiment), **_additions(experiment)}
        write_json(directory / IDENTITY, {**content, "sessions": [_session(command)]})
        return cls(directory, {})

    @classmethod
    def resume(cls, directory: Path, experiment: Experiment, command: str) -> "Journal":
        """The journal of an experiment that ended early; its failed runs count as not done.

        Args:
            directory: of the results.
            experiment: that goes on.
            command: that goes on with it, for the record.

        Raises:
            ResumeError: there is no experiment, or another one.
        """
        try:
            known = json.loads((directory / IDENTITY).read_text(encoding="utf-8"))
            results = entries(directory / RUNS)
        except (OSError, ValueError) as error:
            what = f"`{directory}` holds no experiment to resume; leave `--resume` out"
            raise ResumeError(what) from error
        _check(directory, known, experiment)
        sessions = [*known.get("sessions", []), _session(command)]
        _warn(directory, sessions)
        content = {**known, **_additions(experiment), "sessions": sessions}
        write_json(directory / IDENTITY, content)
        return cls(directory, {k: r for k, r in results.items() if r.error is None})

    def add(self, key: RunKey, result: Result) -> None:
        """Note a finished run; when this returns, it is on the disk."""
        self.results[key] = result
        self._file.write(_line(key, result))
        self._file.flush()
        os.fsync(self._file.fileno())

    def of_combinations(self, combinations: Collection[int]) -> list[RunKey]:
        """Of each of `combinations` the finished run that was noted last, if there is one."""
        found = {key.combination: key for key in self.results if key.combination in combinations}
        return sorted(found.values())

    def close(self) -> None:
        """Close the file."""
        self._file.close()


def entries(path: Path) -> dict[RunKey, Result]:
    """The finished runs in a file `runs.jsonl`, of each the last attempt.

    Raises:
        OSError: it cannot be read.
    """
    lines = path.read_text(encoding="utf-8").splitlines()
    return dict(entry for line in lines if (entry := _entry(line)) is not None)


def _line(key: RunKey, result: Result) -> str:
    return json.dumps({**asdict(key), **asdict(result)}, allow_nan=False) + "\n"


def _entry(line: str) -> tuple[RunKey, Result] | None:
    """A line read again; `None` for one that was being written when everything ended."""
    try:
        content = json.loads(line)
    except ValueError:
        return None
    key = RunKey(content.pop("seed"), content.pop("combination"))
    return key, Result(**content)


def _identity(experiment: Experiment) -> dict[str, Any]:
    """What must not change between the runs of one table."""
    return {
        "nlosim": nlosim_version(),
        "factors": list(experiment.factors),
        "combinations": [
            {"levels": dict(c.levels), "overrides": list(c.overrides), "scenario": c.resolved}
            for c in experiment.combinations
        ],
    }


def _additions(experiment: Experiment) -> dict[str, Any]:
    """What may change before an experiment goes on; enough to make its tables again."""
    report = experiment.report
    return {
        "file": str(experiment.path),
        "scenario_file": str(experiment.scenario),
        "seeds": list(experiment.seeds),
        "metrics": dict(experiment.metrics),
        "report": None if report is None else asdict(report),
    }


def _session(command: str) -> dict[str, Any]:
    """Where the results of one start come from."""
    origin = provenance()
    host = {**origin["host"], "cpu": cpu(), "memory_gib": memory_gib()}
    return {"command": command, "commit": commit(), **origin, "host": host}


def _warn(directory: Path, sessions: Sequence[Mapping[str, Any]]) -> None:
    """Say that one table is about to hold results of two states of the code."""
    *former, now = (session["commit"] for session in sessions)
    if former and former[-1] != now:
        what = "`%s` holds runs of commit %s; going on with %s, whose results may differ"
        logger.warning(what, directory, former[-1] or "unknown", now or "unknown")


def _check(directory: Path, known: Mapping[str, Any], experiment: Experiment) -> None:
    # through JSON and back: tuples become lists
    new = json.loads(json.dumps(_identity(experiment)))
    changed = [key for key in new if new[key] != known.get(key)]
    if changed:
        what = {"nlosim": "the version of nlosim", "factors": "the factors"}
        names = what.get(changed[0], "the levels, `set` or the scenario")
        raise ResumeError(
            f"`{directory}` holds another experiment: {names} changed since; only seeds and "
            "metrics may be added. Choose another --out, without --resume"
        )
    lost = sorted(set(known["seeds"]) - set(experiment.seeds))
    if lost:
        raise ResumeError(
            f"`{directory}` holds runs with seeds that the file does not have any more "
            f"({lost[0]}{', ...' if len(lost) > 1 else ''}); seeds can only be added"
        )
