"""The tables and the report of an experiment, from what is stored in its directory.

runs.parquet, summary.csv   see `orchestrator.experiment.tables`
report/                     what the report of the experiment file writes
"""

import json
import shutil
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from orchestrator.blame import blamed
from orchestrator.experiment import stored, tables
from orchestrator.experiment.report import ExperimentFindings, experiment_report_type

REPORT: Final = "report"
"""The folder that belongs to the report."""


@dataclass(frozen=True, slots=True)
class Summary:
    """What all runs of each combination say together.

    Attributes:
        rows: one per combination; see `orchestrator.experiment.tables.summary`.
        units: of metrics, as far as they have one.
    """

    rows: list[tables.Row]
    units: Mapping[str, str]


def write_tables(directory: Path) -> Summary:
    """Write `runs.parquet` and `summary.csv`; the summary.

    Raises:
        MissingExtraError: pyarrow is not installed.
        StoredError: there is no experiment in `directory`.
    """
    results = stored.read(directory)
    table = tables.summary(results.experiment, results.rows)
    units = tables.units(results.experiment, results.metrics)
    tables.write_runs(directory, results.experiment, results.rows, units)
    tables.write_summary(directory, table, units)
    return Summary(table, units)


def make_report(directory: Path) -> ExperimentFindings:
    """Make the report anew; the former one stays if this fails. Nothing if there is none to make.

    Raises:
        ComponentTypeError: the report cannot be loaded.
        StoredError: there is no experiment in `directory`.
        ValueError: the report says why it cannot be made.
        PluginError: the report failed.
    """
    results = stored.read(directory)
    wanted = results.experiment.report
    if wanted is None:
        return ExperimentFindings(tables={}, text="")
    report = experiment_report_type(wanted.name)()
    with tempfile.TemporaryDirectory(dir=directory, prefix=f"{REPORT}.draft-") as scratch:
        draft = Path(scratch) / REPORT
        draft.mkdir()
        with blamed(f"the report `{wanted.name}`", says=(ValueError,)):
            findings = report.write(results, draft)
        with blamed(f"the tables of the report `{wanted.name}`"):  # programs could not read them
            json.dumps(findings.tables, allow_nan=False)
        shutil.rmtree(directory / REPORT, ignore_errors=True)
        draft.replace(directory / REPORT)
    return findings
