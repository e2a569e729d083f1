"""`table-sink`: a table that is written."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from typing_extensions import override

from adapters.tables.heading import Heading
from orchestrator.component import Component
from orchestrator.errors import ComponentTypeError, ParameterError, ParameterProblem
from orchestrator.parameters import parameter
from orchestrator.signal import Causality, Connector, Signals, Variability
from orchestrator.table_files import FORMATS, NO_PARQUET, has_parquet, write_table
from orchestrator.timebase import Duration, Time, seconds


class TableSink(Component):
    """Writes what it sees at each of its communication points as a row of a table.

    The first row has what it sees at the start. The file is written when the run ends, also with
    an error.
    """

    @dataclass(frozen=True, slots=True, kw_only=True)
    class Parameters:
        """What is written, and where.

        Attributes:
            folder: that exists.
            file: a name in it.
            columns: headings.
        """

        folder: Path = parameter(doc="where the file is written; it must exist")
        file: str = parameter(doc="name of the file, `.csv` or `.parquet`; an old one is replaced")
        columns: tuple[str, ...] = parameter(
            doc="the inputs as headings, `v [km/h]`; they become columns behind `time [s]`"
        )

    def __init__(self, parameters: Parameters) -> None:
        self._path = parameters.folder / parameters.file
        problems = list(_file_problems(parameters.file))
        headings: list[Heading] = []
        for k, text in enumerate(parameters.columns):
            try:
                heading = Heading.parse(text)
            except ValueError as error:
                problems.append(ParameterProblem(("columns", k), str(error)))
                continue
            if heading.name in ["time", *(each.name for each in headings)]:
                what = f"there is a column `{heading.name}` already"
                problems.append(ParameterProblem(("columns", k), what))
            headings.append(heading)
        if not parameters.columns:
            problems.append(ParameterProblem(("columns",), "name one column at least"))
        if problems:
            raise ParameterError(problems)
        self._headings = headings
        self._connectors = {
            heading.name: Connector(
                causality=Causality.INPUT, unit=heading.unit, variability=Variability.CONTINUOUS
            )
            for heading in headings
        }
        self._times: list[Time] = []
        self._rows: list[list[float]] = []

    @property
    @override
    def connectors(self) -> Mapping[str, Connector]:
        return self._connectors

    @override
    def setup(self, start: Time, rng: np.random.Generator) -> None:
        self._times, self._rows = [start], []

    @override
    def initialise(self, inputs: Signals) -> None:
        self._note(inputs)

    @override
    def step(self, inputs: Signals, t: Time, h: Duration) -> None:
        self._times.append(t + h)
        self._note(inputs)

    @override
    def outputs(self) -> Signals:
        return {}

    @override
    def close(self) -> None:
        if not self._rows:
            return
        values = np.array(self._rows)
        table = {"time [s]": np.array([seconds(t) for t in self._times[: len(values)]])}
        for k, heading in enumerate(self._headings):
            unit = "" if heading.unit == "1" else f" [{heading.unit}]"
            table[f"{heading.name}{unit}"] = values[:, k]
        self._rows = []
        try:
            write_table(table, self._path)
        except OSError as error:
            what = f"cannot write `{self._path}`: {error.strerror}"
            raise ComponentTypeError(what) from error

    def _note(self, inputs: Signals) -> None:
        self._rows.append([float(inputs[heading.name]) for heading in self._headings])


def _file_problems(name: str) -> list[ParameterProblem]:
    suffix = Path(name).suffix.removeprefix(".")
    if suffix not in FORMATS or Path(name).name != name:
        what = f"expected the name of a file, `.csv` or `.parquet`, got `{name}`"
        return [ParameterProblem(("file",), what)]
    if suffix == "parquet" and not has_parquet():
        return [ParameterProblem(("file",), NO_PARQUET)]
    return []
