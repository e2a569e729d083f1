"""Folders of experiments that nobody ran: journals with the results that a test wants."""

from collections.abc import Callable, Mapping, Sequence
from itertools import product
from pathlib import Path
from typing import Any

from orchestrator.campaign.work import Result, RunKey
from orchestrator.experiment.journal import Journal
from orchestrator.experiment.plan import Combination, Experiment
from orchestrator.scenario.document import Document

Outcome = Mapping[str, Any] | str
"""The metrics of a run, or why it failed."""


def planned(
    factors: Mapping[str, Sequence[str]],
    seeds: Sequence[int],
    metrics: Mapping[str, str],
    scenario: str = "/scenes/street corner.yaml",
) -> Experiment:
    """An experiment with every combination of levels; each level sets a path of its factor."""
    combinations = [
        Combination(
            dict(zip(factors, levels, strict=True)),
            (
                "time.stop=2 s",
                *(f"components.{f}.level={each}" for f, each in zip(factors, levels, strict=True)),
            ),
            {"title": "A street", "description": "With <b>cars</b>."},
        )
        for levels in product(*factors.values())
    ]
    return Experiment(
        path=Path("/studies/street.yaml"),
        scenario=Path(scenario),
        seeds=tuple(seeds),
        combinations=tuple(combinations),
        metrics=metrics,
        report=None,
        document=Document("street.yaml", {}, {}),
    )


def conducted(
    directory: Path,
    experiment: Experiment,
    outcome: Callable[[RunKey, Mapping[str, str]], Outcome | None],
) -> Path:
    """A directory with what became of every run; `None`: it was not run."""
    directory.mkdir(parents=True)
    journal = Journal.begin(directory, experiment, "nlosim experiment street.yaml --out there")
    for key in experiment.runs():
        found = outcome(key, experiment.combinations[key.combination].levels)
        if isinstance(found, str):
            journal.add((key, Result(wall=0.5, fingerprint=None, metrics={}, error=found)))
        elif found is not None:
            print_of = f"{key.combination:02x}{key.seed:02x}" * 16
            journal.add((key, Result(wall=1.5, fingerprint=print_of, metrics=found, error=None)))
    journal.close()
    return directory
