"""What is known of an experiment that is under way.

experiment.json   what the experiment is, and who began it and went on
runs.jsonl        one line of JSON per finished run, with all its metrics
"""

import logging
from collections.abc import Collection, Iterable, Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any, Final

from typing_extensions import override

from orchestrator.campaign import journal
from orchestrator.campaign.journal import Identity, Kind, ResumeError, session
from orchestrator.campaign.work import Result, RunKey
from orchestrator.experiment.plan import Experiment

logger = logging.getLogger(__name__)

IDENTITY: Final = "experiment.json"
RUNS: Final = "runs.jsonl"

KIND: Final = Kind(
    noun="experiment",
    identity=IDENTITY,
    sessions=IDENTITY,
    entries=RUNS,
    ordered=False,
    growing="seeds and metrics",
    names={"factors": "the factors", "combinations": "the levels, `set` or the scenario"},
    remarks={"commit": "holds runs of commit"},
)


class Journal(journal.Journal[tuple[RunKey, Result]]):
    """The finished runs of an experiment.

    Attributes:
        results: by run; of failed ones the last attempt.
    """

    def __init__(self, directory: Path, results: Mapping[RunKey, Result]) -> None:
        self.results: dict[RunKey, Result] = {}
        super().__init__(directory / RUNS, results.items())

    @classmethod
    def begin(cls, directory: Path, experiment: Experiment, command: str) -> "Journal":
        """The journal of a new experiment, in an empty directory.

        Args:
            directory: of the results.
            experiment: that begins.
            command: that began it, for the record.
        """
        _identity(experiment).begin(directory, session(command, experiment.wording))
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
        identity = _identity(experiment)
        former = identity.former(directory)
        results = entries(former.lines)
        _check_seeds(directory, {key.seed for key in results}, experiment)
        identity.go_on(directory, former, session(command, experiment.wording))
        return cls(directory, {k: r for k, r in results.items() if r.error is None})

    def of_combinations(self, combinations: Collection[int]) -> list[RunKey]:
        """The finished run that was noted last of each of `combinations` that has one."""
        found = {key.combination: key for key in self.results if key.combination in combinations}
        return sorted(found.values())

    @override
    def _note(self, entry: tuple[RunKey, Result]) -> None:
        key, result = entry
        self.results[key] = result

    @override
    def _content(self, entry: tuple[RunKey, Result]) -> Mapping[str, Any]:
        key, result = entry
        return {**asdict(key), **asdict(result)}


def entries(lines: Iterable[dict[str, Any]]) -> dict[RunKey, Result]:
    """The finished runs in the lines of a file `runs.jsonl`, of each the last attempt."""
    found = {}
    for content in lines:
        try:
            key = RunKey(content.pop("seed"), content.pop("combination"))
            found[key] = Result(**content)
        except (KeyError, TypeError):
            logger.warning("a line of `%s` is damaged, and left out: %s", RUNS, content)
    return found


def _identity(experiment: Experiment) -> Identity:
    """The experiment; what may change is enough to make its tables again."""
    report, wording = experiment.report, experiment.wording
    private = {"private": True} if experiment.private else {}
    return Identity(
        kind=KIND,
        fixed={
            **private,
            "factors": list(experiment.factors),
            "combinations": [
                wording.plain(
                    {
                        "levels": dict(c.levels),
                        "overrides": list(c.overrides),
                        "scenario": c.resolved,
                    }
                )
                for c in experiment.combinations
            ],
        },
        growing={
            "file": wording.plain(str(experiment.path)),
            "scenario_file": wording.plain(str(experiment.scenario)),
            "seeds": list(experiment.seeds),
            "metrics": dict(experiment.metrics),
            "report": None if report is None else asdict(report),
            "transport": experiment.transport,
        },
    )


def _check_seeds(directory: Path, known: Collection[int], experiment: Experiment) -> None:
    lost = sorted(set(known) - set(experiment.seeds))
    if lost:
        raise ResumeError(
            f"`{directory}` holds runs with seeds that the file does not have any more "
            f"({lost[0]}{', ...' if len(lost) > 1 else ''}); "
            "seeds can be added, and left out if no run was made with them"
        )
