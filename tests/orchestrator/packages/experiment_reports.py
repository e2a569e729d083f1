"""Reports of experiments: one that counts, one that refuses, one with a bug."""

from collections.abc import Iterator
from pathlib import Path

from typing_extensions import override

from orchestrator.experiment.plan import Experiment
from orchestrator.experiment.report import (
    ExperimentFindings,
    ExperimentReport,
    Results,
)
from orchestrator.parameters import ParameterProblem


class Tally(ExperimentReport):
    """Counts runs per seed; `unit` is what it calls them."""

    @override
    def check(self, experiment: Experiment) -> Iterator[ParameterProblem]:
        assert experiment.report is not None
        for name, value in experiment.report.parameters.items():
            if name != "unit":
                yield ParameterProblem((name,), "write `unit`", at_key=True)
            elif not isinstance(value, str):
                yield ParameterProblem((name,), "expected text")

    @override
    def write(self, results: Results, directory: Path) -> ExperimentFindings:
        plan = results.experiment.report
        assert plan is not None
        unit = plan.parameters.get("unit", "runs")
        both = zip(results.metrics, results.rows, strict=True)
        assert all(m["samples"] == row["samples"] for m, row in both)
        seeds = results.experiment.seeds
        table = [
            {"seed": seed, "n": sum(row["seed"] == seed for row in results.rows)} for seed in seeds
        ]
        text = f"{len(results.rows)} of {len(results.experiment.runs())} {unit}"
        (directory / "tally.txt").write_text(f"{text}, {results.sessions[0]['command']}")
        return ExperimentFindings(tables={"tally": table}, text=text)


class Refusing(Tally):
    """Has nothing to say."""

    @override
    def write(self, results: Results, directory: Path) -> ExperimentFindings:
        (directory / "half.txt").write_text("half")
        raise ValueError("too few runs")


class Careless(Tally):
    """Raises an error before the first run."""

    @override
    def check(self, experiment: Experiment) -> Iterator[ParameterProblem]:
        yield from ()
        raise LookupError("no such column")


class Faulty(Tally):
    """Raises an error."""

    @override
    def write(self, results: Results, directory: Path) -> ExperimentFindings:
        raise LookupError("no such thing")
