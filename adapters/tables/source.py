"""`table-source`: a table that is played back."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
from typing_extensions import override

from adapters.tables.content import Content, read
from orchestrator.component import ForeseenComponent
from orchestrator.errors import ComponentTypeError
from orchestrator.input_files import FileCheck, FileReadingComponent
from orchestrator.parameters import parameter
from orchestrator.signal import Array, Causality, Connector, Signals, Variability
from orchestrator.timebase import Duration, Time, seconds


class TableSource(FileReadingComponent, ForeseenComponent):
    """Plays a table back: every column but that of the times is an output.

    Times count from zero of the simulated time. A time between two nanoseconds is rounded. Numbers
    are float64; `true` is 1, `false` is 0.
    """

    @dataclass(frozen=True, slots=True, kw_only=True)
    class Parameters:
        """What is played back, and how.

        Attributes:
            file: the table.
            time: the name of the column with the times.
            interpolation: between two rows.
            beyond: behind the last row, and before the first.
        """

        file: Path = parameter(doc="a table, `.csv` or `.parquet`, with headings like `v [km/h]`")
        time: str = parameter("time", doc="name of the column with the times; in s without a unit")
        interpolation: Literal["hold", "linear"] = parameter(
            "hold", doc="between two rows: the value of the earlier one, or a straight line"
        )
        beyond: Literal["hold", "error"] = parameter(
            "hold", doc="behind the last row and before the first: the value there, or an error"
        )

    def __init__(self, parameters: Parameters) -> None:
        content, problems = read(parameters.file, parameters.time)
        if content is None:
            raise ComponentTypeError("\n".join(map(str, problems)))
        self._parameters = parameters
        self._content: Content = content
        self._values: dict[str, Array] = {}
        is_linear = parameters.interpolation == "linear"
        self._connectors = {
            heading.name: Connector(
                causality=Causality.OUTPUT,
                unit=heading.unit,
                variability=Variability.CONTINUOUS if is_linear else Variability.DISCRETE,
            )
            for heading in content.columns
        }

    @classmethod
    @override
    def input_files(cls, parameters: Any) -> Iterable[Path]:
        return (parameters.file,)

    @classmethod
    @override
    def check_files(cls, parameters: Any, *, thorough: bool) -> FileCheck:
        return FileCheck(problems=read(parameters.file, parameters.time)[1])

    @classmethod
    @override
    def foreseen_connectors(cls) -> Mapping[str, Connector]:
        return {"<column>": Connector(causality=Causality.OUTPUT, description="each column")}

    @property
    @override
    def connectors(self) -> Mapping[str, Connector]:
        return self._connectors

    @override
    def setup(self, start: Time, rng: np.random.Generator) -> None:
        self._show(start)

    @override
    def step(self, inputs: Signals, t: Time, h: Duration) -> None:
        self._show(t + h)

    @override
    def outputs(self) -> Signals:
        return self._values

    def _show(self, t: Time) -> None:
        """Look the values at `t` up."""
        times = self._content.times
        first, last = int(times[0]), int(times[-1])
        if self._parameters.beyond == "error" and not first <= t <= last:
            raise ValueError(
                f"{self._parameters.file}: the table is from {seconds(first):g} s to "
                f"{seconds(last):g} s, and there is nothing for {seconds(t):g} s; with "
                "`beyond: hold` the nearest row holds"
            )
        k = max(int(np.searchsorted(times, t, side="right")) - 1, 0)
        columns = self._content.columns.items()
        share = 0.0
        if self._parameters.interpolation == "linear" and first < t < last:
            share = (t - int(times[k])) / (int(times[k + 1]) - int(times[k]))
        self._values = {heading.name: _between(column, k, share) for heading, column in columns}


def _between(column: Array, k: int, share: float) -> Array:
    """The value in row `k`, or so far on the way to the next row."""
    if share == 0.0:
        return np.asarray(column[k])
    return np.asarray((1 - share) * column[k] + share * column[k + 1])
