"""A heat map of differences: one colour for each sign, and the numbers in the cells."""

from collections.abc import Sequence
from pathlib import Path
from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap, TwoSlopeNorm
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from orchestrator.drawing import styled, write
from orchestrator.palette import BLUE, VERMILLION
from studies.method.style import method_name
from studies.relay.advantage import Cell, Map, by_row

_COLOURS: Final = LinearSegmentedColormap.from_list("advantage", [VERMILLION, "#FFFFFF", BLUE])
"""From the colour of the one method over white to that of the other, of Okabe and Ito's palette."""

_STRONG: Final = 0.62
"""From this share of the scale on a cell is so dark that text on it is white."""


def draw(found: Sequence[Cell], asked: Map, path: Path) -> None:
    """Draw a map to `path` without suffix; cells whose interval contains 0 are hatched."""
    table = by_row(found)
    columns = [cell.column for cell in next(iter(table.values()))]
    values = [abs(cell.difference.value) for cell in found if cell.difference is not None]
    scale = max(10.0, *values) if values else 10.0
    with styled():
        figure = Figure(figsize=(1.5 + 1.35 * len(columns), 1.2 + 0.8 * len(table)))
        figure.set_layout_engine("constrained")
        axes = figure.add_subplot()
        axes.grid(visible=False)
        for y, row in enumerate(table.values()):
            for x, cell in enumerate(row):
                _draw_cell(axes, cell, x, y, scale)
        axes.set_xlim(-0.5, len(columns) - 0.5)
        axes.set_ylim(len(table) - 0.5, -0.5)
        axes.set_xticks(range(len(columns)), columns)
        axes.set_yticks(range(len(table)), list(table))
        axes.tick_params(length=0)
        axes.set_xlabel(asked.columns.replace("_", " "))
        axes.set_ylabel(asked.rows.replace("_", " "))
        axes.set_title(
            f"PRR of {method_name(asked.better)} minus {method_name(asked.worse)} [points]",
            fontsize=9,
            loc="left",
        )
        write(figure, path)


def _draw_cell(axes: Axes, cell: Cell, x: int, y: int, scale: float) -> None:
    found = cell.difference
    value = 0.0 if found is None else found.value
    shade = TwoSlopeNorm(0.0, -scale, scale)(value)
    axes.add_patch(
        Rectangle(
            (x - 0.5, y - 0.5),
            1.0,
            1.0,
            facecolor=_COLOURS(float(np.asarray(shade))),
            edgecolor="#8C8C8C" if not cell.is_decided else "#FFFFFF",
            hatch=None if cell.is_decided else "///",
            linewidth=0.8,
        )
    )
    is_dark = cell.is_decided and abs(value) > _STRONG * scale
    text = "no runs" if found is None else f"{value:+.1f}"
    if found is not None and found.low is not None and found.high is not None:
        text += f"\n{found.low:.1f} to {found.high:.1f}"
    box = None if cell.is_decided else {"facecolor": "white", "edgecolor": "none", "pad": 1.5}
    axes.text(
        x, y, text, ha="center", va="center", fontsize=8, color="white" if is_dark else "black",
        bbox=box,
    )  # fmt: skip
