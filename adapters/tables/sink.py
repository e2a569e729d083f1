"""`table-sink`: a table that is written."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from typing_extensions import override

from adapters.tables.heading import Heading
from orchestrator.absence import Undriven
from orchestrator.component import ForeseenComponent
from orchestrator.errors import ComponentTypeError, ParameterError, ParameterProblem
from orchestrator.output_files import FileWritingComponent
from orchestrator.parameters import parameter
from orchestrator.signal import Causality, Connector, Signals, Variability
from orchestrator.table_files import FORMATS, NO_PARQUET, has_parquet, write_table
from orchestrator.timebase import Duration, Time, seconds


class TableSink(FileWritingComponent, ForeseenComponent):
    """Writes what it sees at each of its communication points as a row of a table.

    The first row has what it sees at the start. The file is written when the run ends, also with
    an error.
    """

    @dataclass(frozen=True, slots=True, kw_only=True)
    class Parameters:
        """What is written, and where.

        Attributes:
            folder: that exists; `None`: the directory of the run.
            file: a name in it.
            columns: headings.
        """

        folder: Path | None = parameter(
            None, doc="where the file is written, which must exist; without it, the run directory"
        )
        file: str = parameter(doc="name of the file, `.csv` or `.parquet`; an old one is replaced")
        columns: tuple[str, ...] = parameter(
            doc="the inputs as headings, `v [km/h]`; they become columns behind `time [s]`"
        )

    def __init__(self, parameters: Parameters) -> None:
        self._folder, self._file = parameters.folder, parameters.file
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
                causality=Causality.INPUT,
                unit=heading.unit,
                variability=Variability.CONTINUOUS,
                undriven=Undriven("its column has zeros"),
                parameter=("columns", k),
            )
            for k, heading in enumerate(headings)
        }
        self._times: list[Time] = []
        self._rows: list[list[float]] = []

    @classmethod
    @override
    def output_files(cls, parameters: Any) -> Iterable[Path]:
        folder = Path() if parameters.folder is None else parameters.folder.absolute()
        return (folder / parameters.file,)

    @override
    def write_into(self, directory: Path) -> None:
        self._folder = self._folder or directory

    @classmethod
    @override
    def foreseen_connectors(cls) -> Mapping[str, Connector]:
        return {"<column>": Connector(causality=Causality.INPUT, description="each column")}

    @property
    @override
    def connectors(self) -> Mapping[str, Connector]:
        return self._connectors

    @override
    def setup(self, start: Time, rng: np.random.Generator) -> None:
        if self._folder is None:
            raise ComponentTypeError(f"nobody said where to write `{self._file}`; give `folder`")
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
        if not self._rows or self._folder is None:
            return
        values = np.array(self._rows)
        table = {"time [s]": np.array([seconds(t) for t in self._times[: len(values)]])}
        for k, heading in enumerate(self._headings):
            unit = "" if heading.unit == "1" else f" [{heading.unit}]"
            table[f"{heading.name}{unit}"] = values[:, k]
        self._rows = []
        path = self._folder / self._file
        try:
            write_table(table, path)
        except OSError as error:
            what = f"cannot write `{path}`: {error.strerror}"
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
