"""The report `relay-sensitivity`: what the result of the relay study depends on.

relay_sensitivity.csv               per setting and method: every metric with its interval
relay_sensitivity_provenance.json   commands, commits, machine, versions, cost
"""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from typing_extensions import override

from orchestrator.experiment import tables
from orchestrator.experiment.plan import Experiment
from orchestrator.experiment.report import (
    ExperimentFindings,
    ExperimentReport,
    Results,
)
from orchestrator.parameters import ParameterProblem
from orchestrator.recording.layout import write_json
from studies.method import csv_file
from studies.method.text import columns_of_text, interval
from studies.relay.provenance import provenance
from studies.relay.sample import METHOD

SETTING: Final = "setting"
NAME: Final = "relay_sensitivity"
TABLE: Final = f"{NAME}.csv"
PROVENANCE: Final = f"{NAME}_provenance.json"


class RelaySensitivity(ExperimentReport):
    """The relay study under other settings, one at a time.

    Needs the factors `method` and `setting` and the metric `prr`; has no parameters.
    """

    @override
    def check(self, experiment: Experiment) -> Iterator[ParameterProblem]:
        assert experiment.report is not None  # noqa: S101 - this is its report
        for name in experiment.report.parameters:
            yield ParameterProblem((name,), f"there is no parameter `{name}`", at_key=True)
        for noun, needed, offers in (
            ("factor", (METHOD, SETTING), experiment.factors),
            ("metric", ("prr",), tuple(experiment.metrics)),
        ):
            for name in needed:
                if name not in offers:
                    what = f"the relay sensitivity needs the {noun} `{name}`"
                    yield ParameterProblem((), what)

    @override
    def write(self, results: Results, directory: Path) -> ExperimentFindings:
        table = tables.summary(results.experiment, list(results.rows))
        csv_file.write(directory / TABLE, table)
        write_json(directory / PROVENANCE, provenance(results, {}))
        return ExperimentFindings(tables={NAME: table}, text=_text(table))


def by_setting(
    table: Sequence[Mapping[str, Any]], methods: Sequence[str], empty: str = "-"
) -> list[list[str]]:
    """PRR in % with its interval: a row per setting, a column per method.

    Args:
        table: rows with `method`, `setting`, `prr`, `prr_low` and `prr_high`.
        methods: the columns.
        empty: for combinations that are not in the table.
    """
    found = {(row[SETTING], row[METHOD]): interval(row, "prr", ".1f", scale=100.0) for row in table}
    settings = dict.fromkeys(row[SETTING] for row in table)
    return [[each, *(found.get((each, method), empty) for method in methods)] for each in settings]


def _text(table: list[dict[str, Any]]) -> str:
    methods = list(dict.fromkeys(row[METHOD] for row in table))
    return "\n".join(
        ["PRR in %:", *columns_of_text([[SETTING, *methods], *by_setting(table, methods)])]
    )
