"""Figure 8: the distribution of the packet reception rate over runs."""

import math
from pathlib import Path
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from orchestrator.signal import Array
from studies.method.style import Look, looks, styled, write
from studies.relay import distribution
from studies.relay.paper import TABLE_2
from studies.relay.sample import METHOD, Study

_COLUMNS: Final = 4
"""Of panels."""


def draw(study: Study, path: Path) -> None:
    """Draw Figure 8 to `path`, without suffix: all methods together, and each with its band."""
    steps = distribution.rows(study)
    methods = list(dict.fromkeys(step[METHOD] for step in steps))
    curves = {m: _curve([step for step in steps if step[METHOD] == m]) for m in methods}
    panels = len(methods) + 1
    height = 2.3 * math.ceil(panels / _COLUMNS)
    with styled():
        figure = Figure(figsize=(9.6, height + 0.3), layout="constrained")
        grid = figure.subplots(
            math.ceil(panels / _COLUMNS), _COLUMNS, sharex=True, sharey=True, squeeze=False
        ).ravel()
        _draw_all(grid[0], curves)
        for axes, (method, look) in zip(grid[1:], looks(methods).items(), strict=False):
            _draw_one(axes, curves, method, look)
        for axes in grid[panels:]:
            axes.set_axis_off()
        figure.supxlabel("packet reception rate of a run [%]", fontsize=9)
        figure.supylabel("share of runs with at most that", fontsize=9)
        write(figure, path)


def _curve(steps: list[dict[str, Any]]) -> Array:
    """Corners of the steps, from 0 to 100 %: rate [%], share, lower and upper end of the band."""
    n = steps[0]["n"]
    start = [0.0, 0.0, 0.0, min(1.0, distribution.band(n))]
    corners = [
        [100 * step["prr"], step["share"], step["share_low"], step["share_high"]] for step in steps
    ]
    corners = [start, *corners, [100.0, *corners[-1][1:]]]
    return np.asarray(corners, np.float64)


def _draw_all(axes: Axes, curves: dict[str, Array]) -> None:
    for method, look in looks(list(curves)).items():
        curve = curves[method]
        _draw_curve(axes, curve, look)
    axes.set_title("all methods", fontsize=9)
    axes.set_xlim(-2.0, 102.0)
    axes.set_ylim(-0.02, 1.02)


def _draw_one(axes: Axes, curves: dict[str, Array], method: str, look: Look) -> None:
    for other, curve in curves.items():
        if other != method:
            axes.step(curve[:, 0], curve[:, 1], where="post", color="#bbbbbb", lw=0.7, zorder=1)
    curve = curves[method]
    axes.fill_between(
        curve[:, 0], curve[:, 2], curve[:, 3], step="post", color=look.colour, alpha=0.2, lw=0
    )
    _draw_curve(axes, curve, look)
    if method in TABLE_2:
        axes.axvline(100 * TABLE_2[method].prr, color=look.colour, lw=1.0, ls=":")
    axes.set_title(look.name, fontsize=9)


def _draw_curve(axes: Axes, curve: Array, look: Look) -> None:
    axes.step(
        curve[:, 0],
        curve[:, 1],
        where="post",
        color=look.colour,
        lw=1.5,
        marker=look.marker,
        markersize=3.5,
        markevery=max(1, len(curve) // 6),
    )
