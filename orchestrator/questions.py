"""What is asked of the recording of a run."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from orchestrator.measure import Measure
from orchestrator.report import Report
from orchestrator.table_files import Format


@dataclass(frozen=True, slots=True, kw_only=True)
class Questions:
    """A report, measures, and the form of the answers.

    Attributes:
        report: of the scenario, or `None`.
        report_name: under which it is installed.
        measures: by the name that the metrics are to have; they have to have an answer.
        optional: likewise; those that have none are left out, and it is said why.
        tables: the formats of tables, or `None`: CSV and, if pyarrow is installed, Parquet.
    """

    report: Report | None = None
    report_name: str = ""
    measures: Mapping[str, Measure] = field(default_factory=dict)
    optional: Mapping[str, Measure] = field(default_factory=dict)
    tables: Sequence[Format] | None = None
