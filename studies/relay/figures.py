"""Figures 7 and 8: the packet reception rate over density, and its distribution over runs."""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from orchestrator.drawing import styled, write
from orchestrator.signal import Array
from studies.method.style import Look, bars, looks
from studies.relay.published import TABLE_2
from studies.relay.statistics import DensityPoint, Step, band

_DODGE: Final = 0.25
"""The distance between methods at the same density [vehicles per km and lane], so that no bar hides
another."""

_COLUMNS: Final = 4
"""The number of panels of Figure 8 side by side."""


def draw_density(points: Sequence[DensityPoint], path: Path) -> None:
    """Draw Figure 7, the packet reception rate over the density, to `path` without suffix."""
    methods = list(dict.fromkeys(point.method for point in points))
    with styled():
        figure = Figure(figsize=(7.2, 4.2), layout="constrained")
        axes = figure.add_subplot()
        for k, (method, look) in enumerate(looks(methods).items()):
            shift = (k - (len(methods) - 1) / 2) * _DODGE
            _draw_points(axes, [p for p in points if p.method == method], look, shift)
            if method in TABLE_2:
                axes.axhline(100 * TABLE_2[method].prr, color=look.colour, lw=0.8, ls=":", zorder=1)
        axes.plot([], [], color="black", lw=0.8, ls=":", label="paper's average (Table II)")
        axes.set_xlabel("vehicles per km and lane")
        axes.set_ylabel("packet reception rate [%]")
        axes.set_ylim(-2.0, 102.0)
        axes.set_xticks(sorted({round(point.vehicles_per_km, 1) for point in points}))
        figure.legend(loc="outside right upper")
        write(figure, path)


def _draw_points(axes: Axes, points: Sequence[DensityPoint], look: Look, shift: float) -> None:
    known = [(p.vehicles_per_km + shift, p.prr) for p in points if p.prr is not None]
    axes.errorbar(
        [x for x, _ in known],
        [100 * prr.value for _, prr in known],
        yerr=bars([prr for _, prr in known]),
        color=look.colour,
        marker=look.marker,
        markersize=5.0,
        linewidth=1.3,
        elinewidth=1.0,
        capsize=2.5,
        label=look.name,
        zorder=3,
    )


def draw_distribution(steps: Sequence[Step], path: Path) -> None:
    """Draw Figure 8 to `path` without suffix: all methods together, and each with its band."""
    methods = list(dict.fromkeys(step.method for step in steps))
    curves = {m: _curve([step for step in steps if step.method == m]) for m in methods}
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


def _curve(steps: Sequence[Step]) -> Array:
    """The corners of the steps, from 0 to 100 %, float64, shape (corner, 4).

    Columns: rate [%], and share, lower and upper end of the band, 0 to 1 each.
    """
    start = [0.0, 0.0, 0.0, min(1.0, band(steps[0].n))]
    corners = [[100 * step.prr, step.share, step.share_low, step.share_high] for step in steps]
    corners = [start, *corners, [100.0, *corners[-1][1:]]]
    return np.asarray(corners, np.float64)


def _draw_all(axes: Axes, curves: dict[str, Array]) -> None:
    for method, look in looks(list(curves)).items():
        _draw_curve(axes, curves[method], look)
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
