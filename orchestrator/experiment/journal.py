"""What is known of an experiment that is under way, safe against its sudden end.

experiment.json   what the experiment is; a resumed one must be the same
runs.jsonl        one line of JSON per finished run, with all its metrics, in the order of finishing
"""

import json
import os
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any, Final, TextIO

from orchestrator.errors import CosimError
from orchestrator.experiment.plan import Experiment, RunKey
from orchestrator.experiment.work import Result
from orchestrator.provenance import nlosim_version, provenance
from orchestrator.recording.layout import write_json

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
    def begin(cls, directory: Path, experiment: Experiment) -> "Journal":
        """The journal of a new experiment, in an empty directory."""
        content = {**_identity(experiment), "seeds": list(experiment.seeds), **provenance()}
        write_json(directory / IDENTITY, content)
        return cls(directory, {})

    @classmethod
    def resume(cls, directory: Path, experiment: Experiment) -> "Journal":
        """The journal of an experiment that ended early; its failed runs count as not done.

        Raises:
            ResumeError: there is no experiment, or another one.
        """
        try:
            known = json.loads((directory / IDENTITY).read_text(encoding="utf-8"))
            lines = (directory / RUNS).read_text(encoding="utf-8").splitlines()
        except (OSError, ValueError) as error:
            what = f"`{directory}` holds no experiment to resume; leave `--resume` out"
            raise ResumeError(what) from error
        _check(directory, known, experiment)
        write_json(directory / IDENTITY, {**known, "seeds": list(experiment.seeds)})
        results = dict(entry for line in lines if (entry := _entry(line)) is not None)
        return cls(directory, {k: r for k, r in results.items() if r.error is None})

    def add(self, key: RunKey, result: Result) -> None:
        """Note a finished run; when this returns, it is on the disk."""
        self.results[key] = result
        self._file.write(_line(key, result))
        self._file.flush()
        os.fsync(self._file.fileno())

    def close(self) -> None:
        """Close the file."""
        self._file.close()


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
