"""The report `relay-sensitivity`: what the result of the relay study depends on.

relay_sensitivity.csv               per setting and method: every metric with its interval
relay_sensitivity_provenance.json   commands, commits, machine, versions, cost
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from typing_extensions import override

from orchestrator.experiment import tables
from orchestrator.experiment.plan import Experiment
from orchestrator.experiment.report import (
    ExperimentFindings,
    ExperimentReport,
    Results,
    Row,
)
from orchestrator.intervals import Estimate
from orchestrator.parameters import ParameterProblem
from studies.method import records
from studies.method.report import missing, unknown_parameters
from studies.method.text import columns_of_text, percent_shown
from studies.relay.conditions import METHOD
from studies.relay.provenance import Provenance

SETTING: Final = "setting"
"""The factor whose levels are what is changed."""

NAME: Final = "relay_sensitivity"
TABLE: Final = f"{NAME}.csv"
PROVENANCE: Final = f"{NAME}_provenance.json"


@dataclass(frozen=True, slots=True, kw_only=True)
class SettingResult:
    """What a method does under a setting; all shares are means over runs, 0 to 1.

    Attributes:
        setting: the level of the factor `setting`.
        method: the level of the factor `method`.
        prr: packet reception rate.
        lost_unnoticed: share of the packets that were too weak to be noticed, or not sent.
        lost_noise: share of those that noise made undecodable.
        lost_interference: share of those that interference did.
        lost_receiver_busy: share of those whose receiver was busy with another frame.
        lost_receiver_transmitting: share of those whose receiver was sending itself.
    """

    setting: str
    method: str
    prr: Estimate | None
    lost_unnoticed: float | None = None
    lost_noise: float | None = None
    lost_interference: float | None = None
    lost_receiver_busy: float | None = None
    lost_receiver_transmitting: float | None = None


class RelaySensitivity(ExperimentReport):
    """The relay study under other settings, one at a time.

    Needs the factors `method` and `setting` and the metric `prr`; has no parameters.
    """

    @override
    def check(self, experiment: Experiment) -> Iterator[ParameterProblem]:
        yield from unknown_parameters(experiment, ())
        for noun, needed, offers in (
            ("factor", (METHOD, SETTING), experiment.factors),
            ("metric", ("prr",), tuple(experiment.metrics)),
        ):
            for name in needed:
                yield from missing("relay sensitivity", noun, {name: name}, offers)

    @override
    def write(self, results: Results, directory: Path) -> ExperimentFindings:
        table = tables.summary(results.experiment, list(results.rows))
        records.write(directory / TABLE, table)
        Provenance.of(results, {}).write(directory / PROVENANCE)
        return ExperimentFindings(tables={NAME: table}, text=_text([_of(row) for row in table]))


def by_setting(
    table: Sequence[SettingResult], methods: Sequence[str], empty: str = "-"
) -> list[list[str]]:
    """PRR in % with its interval: a row per setting, a column per method.

    Args:
        table: the results of all settings and methods.
        methods: the columns.
        empty: what stands where a combination is not in the table.
    """
    found = {(row.setting, row.method): percent_shown(row.prr) for row in table}
    settings = dict.fromkeys(row.setting for row in table)
    return [[each, *(found.get((each, method), empty) for method in methods)] for each in settings]


def _of(row: Row) -> SettingResult:
    """The packet reception rate in a row of the summary of an experiment."""
    prr = None if row["prr"] is None else Estimate(row["prr"], row["prr_low"], row["prr_high"])
    return SettingResult(setting=row[SETTING], method=row[METHOD], prr=prr)


def _text(table: Sequence[SettingResult]) -> str:
    methods = list(dict.fromkeys(row.method for row in table))
    return "\n".join(
        ["PRR in %:", *columns_of_text([[SETTING, *methods], *by_setting(table, methods)])]
    )
