"""Reports of experiments: from all runs to tables and figures.

An experiment file names its report; it is found by an entry point in the group
`orchestrator.experiment_reports`, whose value is a class derived from `ExperimentReport`.
"""

import abc
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from orchestrator.experiment.plan import Experiment
from orchestrator.installed import installed_class
from orchestrator.parameters import ParameterProblem

GROUP: Final = "orchestrator.experiment_reports"

Row = Mapping[str, Any]
"""Values by column: numbers, booleans, text or `None`, none of them NaN or infinite."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Results:
    """All that is known of an experiment; it may have been interrupted, and runs may have failed.

    Attributes:
        experiment: what was planned.
        rows: one per finished run, by combination and seed: the level of every factor, `seed`, the
            metrics that the experiment file names, `fingerprint`, `wall_s`, `cpu_s` (`None` if it
            was not noted), and `error`, which is `None` unless the run failed (then there are no
            metrics).
        metrics: of each row all metrics that the scenario's report found; empty if the run failed.
        sessions: one for the first start and for every `--resume`: `command`, `created`, `commit`
            (`None` outside a checkout), `versions` by package, and `host`.
        damaged: what was left out because it is damaged, for people.
    """

    experiment: Experiment
    rows: Sequence[Row]
    metrics: Sequence[Mapping[str, Any]]
    sessions: Sequence[Mapping[str, Any]]
    damaged: Sequence[str] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class ExperimentFindings:
    """What a report of an experiment says besides the files that it writes.

    Attributes:
        tables: by name; with `--json` they stand beside `summary`.
        text: for the terminal.
    """

    tables: Mapping[str, Sequence[Row]]
    text: str


class ExperimentReport(abc.ABC):
    """What all runs of an experiment say together.

    A report is created without arguments and has no state.
    """

    @abc.abstractmethod
    def check(self, experiment: Experiment) -> Iterator[ParameterProblem]:
        """Everything wrong with `experiment.report.parameters`, before the first run.

        Whether the metrics exist is not known yet; their columns (`experiment.metrics`) are.
        """

    @abc.abstractmethod
    def write(self, results: Results, directory: Path) -> ExperimentFindings:
        """Write tables and figures into `directory`, which is empty.

        Called after the last run, after an interruption, and by `nlosim report`; it says what it
        can, and raises `ValueError` or a `CosimError` with a sentence if that is nothing.
        """


def experiment_report_type(name: str) -> type[ExperimentReport]:
    """Load the report called `name`.

    Raises:
        ComponentTypeError: it is not installed, or cannot be loaded.
    """
    noun, base = "report of experiments", ExperimentReport
    return installed_class(GROUP, name, base, noun)  # type: ignore[type-abstract]
