"""What drives the inputs of one FMU: a table, or values that stay."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from typing_extensions import override

from adapters.fmi.command.reading import converted
from adapters.fmi.command.table import Results, TableError
from orchestrator.component import Component
from orchestrator.signal import Array, Causality, Connector, Signals, Variability
from orchestrator.suggestion import suggestion
from orchestrator.timebase import Duration, Time, seconds
from orchestrator.units import UnitError


class Inputs(Component):
    """Publishes values of a table at the communication points.

    Continuous ones are interpolated, others keep the last value. Before the first row its values
    hold, behind the last one those of the last. Where two rows have one time, the second holds.

    Args:
        driven: inputs of the FMU by name.
        table: a column for each, shape (row,) or (row, element).
    """

    def __init__(self, driven: Mapping[str, Connector], table: Results) -> None:
        self._declared = {
            name: replace(
                connector,
                causality=Causality.OUTPUT,
                variability=Variability.DISCRETE,
                undriven=None,
            )
            for name, connector in driven.items()
        }
        self._continuous = {
            name for name, c in driven.items() if c.variability is Variability.CONTINUOUS
        }
        self._table = table
        self._now: Time = 0

    @property
    @override
    def connectors(self) -> Mapping[str, Connector]:
        return self._declared

    @override
    def setup(self, start: Time, rng: np.random.Generator) -> None:
        self._now = start

    @override
    def step(self, inputs: Signals, t: Time, h: Duration) -> None:
        self._now = t + h

    @override
    def outputs(self) -> Signals:
        return {name: self._value(name, connector) for name, connector in self._declared.items()}

    def _value(self, name: str, connector: Connector) -> Array:
        times, column = self._table.times, np.asarray(self._table.columns[name])
        # times of a table are decimal fractions, those of the run whole nanoseconds
        now = seconds(self._now)
        k = int(np.searchsorted(times, now + 1e-10, side="right")) - 1
        value = np.asarray(column[max(k, 0)])
        if name in self._continuous and 0 <= k < len(times) - 1 and now > times[k]:
            share = (now - times[k]) / (times[k + 1] - times[k])
            value = (1 - share) * column[k] + share * column[k + 1]
        shape = tuple(n for n in connector.shape if isinstance(n, int))
        return np.array(value, dtype=connector.dtype).reshape(shape)


def in_units_of(connectors: Mapping[str, Connector], table: Results, path: Path) -> Results:
    """A table whose columns are in the units of the inputs that they drive.

    Raises:
        TableError: the unit in a heading is none of the input's quantity.
    """
    problems, columns = [], dict(table.columns)
    for name, unit in table.units.items():
        if name not in connectors or unit == connectors[name].unit:
            continue
        input_, values = connectors[name], np.asarray(columns[name])
        way = (unit, input_.unit, input_.definition)
        try:
            columns[name] = converted(values, *way, is_difference=input_.is_relative)
        except UnitError as error:
            problems.append(f"{path}:1: `{name}`: {error}")
    if problems:
        raise TableError("\n".join(problems))
    return Results(table.times, columns, {})


def table_of_inputs(
    path: Path, table: Results, connectors: Mapping[str, Connector]
) -> dict[str, Connector]:
    """The inputs that a table drives.

    Raises:
        TableError: a column is no input, has another size, or values that the input cannot have.
    """
    inputs = {n: c for n, c in connectors.items() if c.causality is Causality.INPUT}
    problems = []
    if not len(table.times):
        problems.append(f"{path}: there are no rows")
    for name, column in table.columns.items():
        if name not in inputs:
            problems.append(f"{path}:1: there is no input `{name}`; {suggestion(name, inputs)}")
            continue
        connector = inputs[name]
        if any(isinstance(n, str) for n in connector.shape) or connector.is_binary:
            problems.append(f"{path}:1: the input `{name}` is {connector.kind()}; a table has none")
            continue
        size = int(np.prod([n for n in connector.shape if isinstance(n, int)], dtype=np.int64))
        if size != int(np.prod(column.shape[1:], dtype=np.int64)):
            problems.append(f"{path}: `{name}` has {size} elements, not {column[0].size}")
            continue
        unknown = np.flatnonzero(np.isnan(column).reshape(len(column), -1).any(axis=1))
        if len(unknown):
            problems.append(f"{path}:{int(unknown[0]) + 2}: `{name}`: there is no number")
            continue
        kind = np.dtype(connector.dtype)
        if len(wrong := np.argwhere(~_has(kind, column))):
            value = column[tuple(wrong[0])]
            shown = f"{value:g}" if column.dtype.kind == "f" else str(value)
            problems.append(f"{path}:{int(wrong[0][0]) + 2}: `{name}` is {kind.name}, not {shown}")
    if problems:
        raise TableError("\n".join(problems))
    return {name: inputs[name] for name in table.columns}


def _has(kind: np.dtype[Any], values: Array) -> Array:
    """Whether a type has these numbers, of the shape of `values`; those of floats are rounded."""
    if kind.kind not in "iub":
        return np.ones(values.shape, np.bool_)
    low, high = (0, 1)
    if kind.kind != "b":
        low, high = int(np.iinfo(kind).min), int(np.iinfo(kind).max)
    if values.dtype.kind == "f":  # the float next to `high` may lie above it
        found: Array = (values >= low) & (values < float(high) + 1.0) & (values == np.floor(values))
        return found
    return np.asarray((values >= low) & (values <= high))
