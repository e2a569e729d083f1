"""Metrics of runs by method, condition and seed."""

from dataclasses import dataclass

from orchestrator.experiment.report import Results, Row
from studies.method.estimates import Sample
from studies.relay.conditions import METHOD, Condition, condition_of


@dataclass(frozen=True, slots=True)
class Study:
    """The runs of an experiment, ordered for comparisons.

    Attributes:
        results: everything that the experiment found.
        base: the condition of the paper's main results.
    """

    results: Results
    base: Condition

    @property
    def conditions(self) -> list[Condition]:
        """All conditions, in the order of the experiment file."""
        found: list[Condition] = []
        for combination in self.results.experiment.combinations:
            condition = condition_of(combination.levels)
            if condition not in found:
                found.append(condition)
        return found

    def methods(self, condition: Condition) -> list[str]:
        """The methods that are run there, in the order of the experiment file."""
        combinations = self.results.experiment.combinations
        return [c.levels[METHOD] for c in combinations if condition_of(c.levels) == condition]

    def rows(self, method: str, condition: Condition) -> list[Row]:
        """The runs that did not fail."""
        wanted = {METHOD: method, **condition}
        return [
            row
            for row in self.results.rows
            if row["error"] is None and all(row[name] == level for name, level in wanted.items())
        ]

    def sample(self, metric: str, method: str, condition: Condition) -> Sample:
        """A metric by seed; runs in which there was nothing to measure are left out."""
        rows = self.rows(method, condition)
        return {row["seed"]: float(row[metric]) for row in rows if row[metric] is not None}
