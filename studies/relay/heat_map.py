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
from orchestrator.palette import BLUE, GREY, LIGHT, VERMILLION
from studies.method.style import method_name
from studies.relay.advantage import Cell, Map, by_row

_COLOURS: Final = LinearSegmentedColormap.from_list("advantage", [VERMILLION, "white", BLUE])
"""From the colour of the one method over white to that of the other, of Okabe and Ito's palette."""

_STRONG: Final = 0.62
"""From this share of the scale on a cell is so dark that text on it is white."""

_HATCH: Final = LIGHT
"""The colour of the hatching of cells whose sign is not known: under text that stays legible."""


def draw(found: Sequence[Cell], asked: Map, path: Path) -> None:
    """Draw a map to `path` without suffix.

    Only cells whose interval leaves out 0 are coloured; the others are hatched.
    """
    table = by_row(found)
    columns = [cell.column for cell in next(iter(table.values()))]
    decided = [abs(cell.difference.value) for cell in found if cell.difference and cell.is_decided]
    scale = max(10.0, *decided) if decided else 10.0
    with styled():
        figure = Figure(figsize=(1.5 + 1.35 * len(columns), 1.4 + 0.8 * len(table)))
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
        axes.set_title(_title(found, asked), fontsize=9, loc="left")
        write(figure, path)


def _title(found: Sequence[Cell], asked: Map) -> str:
    better, worse = method_name(asked.better), method_name(asked.worse)
    seeds = sorted({cell.n for cell in found})
    each = f"{seeds[0]} seeds" if len(seeds) == 1 else f"{seeds[0]} to {seeds[-1]} seeds"
    return (
        f"PRR of {better} minus {worse} [points], {each} per cell\n"
        f"blue: {better} delivers more; orange: less; hatched: the interval of 95 % contains 0"
    )


def _draw_cell(axes: Axes, cell: Cell, x: int, y: int, scale: float) -> None:
    found = cell.difference
    value = found.value if found is not None and cell.is_decided else 0.0
    shade = TwoSlopeNorm(0.0, -scale, scale)(value)
    corner = (x - 0.5, y - 0.5)
    if not cell.is_decided:
        hatching = Rectangle(corner, 1.0, 1.0, fill=False, ec=_HATCH, hatch="///", linewidth=0.0)
        axes.add_patch(hatching)
    fill = _COLOURS(float(np.asarray(shade))) if cell.is_decided else "none"
    axes.add_patch(Rectangle(corner, 1.0, 1.0, fc=fill, ec=GREY, linewidth=0.8))
    text = "no runs" if found is None else f"{found.value:+.1f}"
    if found is not None and found.low is not None and found.high is not None:
        text += f"\n{found.low:.1f} to {found.high:.1f}"
    is_dark = abs(value) > _STRONG * scale
    axes.text(
        x, y, text, ha="center", va="center", fontsize=8, color="white" if is_dark else "black",
        fontweight="bold" if cell.is_decided else "normal",
    )  # fmt: skip
