"""Results over time: in files, in a run directory, as lines of text, as a figure."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from orchestrator.errors import CosimError
from orchestrator.signal import Array
from orchestrator.table_files import write_table

TIME: Final = "time"
"""The column of times [s]."""

_BLOCKS: Final = "▁▂▃▄▅▆▇█"
_WIDTH: Final = 60
"""Characters of a line of text over the whole time."""


class TableError(CosimError):
    """A table that cannot be used; a line for each problem, with file and line. Exit code 2."""


@dataclass(frozen=True, slots=True, eq=False)
class Results:
    """Variables over time.

    Attributes:
        times: [s], ascending; equal ones are a step. Shape (row,).
        columns: by name, shape (row,), or (row, element) of an array.
        units: of columns, as far as they are known.
    """

    times: Array
    columns: Mapping[str, Array]
    units: Mapping[str, str]


def write_results(results: Results, path: Path) -> None:
    """Write to a CSV or Parquet file, by its suffix; elements of arrays are columns `name[k]`.

    Raises:
        MissingParquetError: pyarrow is not installed.
        OSError: it cannot be written.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    write_table({TIME: results.times, **dict(scalars(results))}, path)


def scalars(results: Results) -> Iterator[tuple[str, Array]]:
    """Columns of single numbers, shape (row,); elements of arrays as `name[k]`, from 0."""
    for name, column in results.columns.items():
        if column.ndim == 1:
            yield name, column
        else:
            flat = _rows(column)
            yield from ((f"{name}[{k}]", flat[:, k]) for k in range(flat.shape[1]))


def _rows(column: Array) -> Array:
    """The elements of each row side by side, shape (row, element), also where there is no row."""
    return column.reshape(len(column), math.prod(column.shape[1:]))


def summary(results: Results) -> str:
    """Last, least, greatest and mean value of every number over time."""
    rows: list[tuple[str, ...]] = [("", "last", "min", "max", "mean", "unit")]
    for name, column in scalars(results):
        known = np.asarray(column, np.float64)
        if len(known):
            unit = results.units.get(name) or results.units.get(name.rpartition("[")[0], "")
            found = (known[-1], known.min(), known.max(), _mean(results.times, known))
            rows.append((name, *(f"{value:.6g}" for value in found), unit))
    widths = [max(len(row[k]) for row in rows) for k in range(len(rows[0]))]
    return "\n".join(
        f"{row[0]:{widths[0]}}  "
        + "  ".join(f"{cell:>{width}}" for cell, width in zip(row[1:5], widths[1:5], strict=True))
        + f"  {row[5]}".rstrip()
        for row in rows
    )


def _mean(times: Array, values: Array) -> float:
    """The mean over time, by the trapezoidal rule."""
    span = float(times[-1] - times[0])
    area = float(np.sum((values[1:] + values[:-1]) / 2 * np.diff(times)))
    return area / span if span > 0 else float(values.mean())


def lines_of_text(results: Results) -> str:
    """A line for each number over time, in blocks."""
    lines = []
    for name, column in scalars(results):
        values = np.asarray(column, np.float64)
        if not len(values) or not np.isfinite(values).all():
            continue
        low, high = float(values.min()), float(values.max())
        span = high - low
        at = np.linspace(results.times[0], results.times[-1], _WIDTH)
        places = np.searchsorted(results.times, at, side="right") - 1
        share = (values[places] - low) / span if span > 0 else np.zeros(_WIDTH)
        line = "".join(_BLOCKS[min(7, math.floor(8 * s))] for s in share)
        lines.append(f"{name}\n  {line}  {low:.6g} .. {high:.6g}")
    end = f"{results.times[-1]:g} s" if len(results.times) else ""
    start = f"{results.times[0]:g} s" if len(results.times) else ""
    return "\n".join([*lines, f"  {start:<{_WIDTH - len(end)}}{end}"])


def draw(results: Results, path: Path) -> None:
    """Draw a panel for each variable into an SVG or PNG file."""
    from orchestrator.drawing import draw_panels  # noqa: PLC0415 - matplotlib is slow to load

    def panel(name: str) -> Any:
        def drawn(axes: Any) -> None:
            column = np.asarray(results.columns[name])
            axes.plot(results.times, _rows(column), lw=1.0)
            axes.set_xlabel("time [s]")
            unit = results.units.get(name, "1")
            axes.set_ylabel("" if unit == "1" else f"[{unit}]")

        return drawn

    panels = {name: panel(name) for name in results.columns}
    draw_panels(panels, path.with_suffix(""), suffix=path.suffix)
