"""Figures 7 and 8: the packet reception rate over density, and its distribution over runs."""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from orchestrator.drawing import SMALL, WIDTH, styled, write
from orchestrator.palette import BLACK, GREY, LIGHT, PALE
from orchestrator.signal import Array
from studies.method.style import Look, bars, looks
from studies.relay.published import TABLE_2
from studies.relay.statistics import DensityPoint, Step, band

_DODGE: Final = 0.25
"""The distance between methods at the same density [vehicles per km and lane], so that no bar hides
another."""

_COLUMNS: Final = 2
"""The number of panels of Figure 8 side by side."""

_PALE: Final = PALE
"""The colour of what is only to be compared with."""

_BREAK: Final = 75.0
"""Where the scale of Figure 8 changes [%]: most runs are above."""

_SHRUNK: Final = 4.0
"""The factor by which rates below are drawn smaller."""


def draw_density(points: Sequence[DensityPoint], path: Path) -> None:
    """Draw Figure 7, the packet reception rate over the density, to `path` without suffix."""
    methods = list(dict.fromkeys(point.method for point in points))
    with styled():
        figure = Figure(figsize=(WIDTH, 4.4), layout="constrained")
        axes = figure.add_subplot()
        for k, (method, look) in enumerate(looks(methods).items()):
            shift = (k - (len(methods) - 1) / 2) * _DODGE
            _draw_points(axes, [p for p in points if p.method == method], look, shift)
        densities = sorted({round(point.vehicles_per_km, 1) for point in points})
        if densities:
            _draw_published(axes, methods, sum(densities[-2:]) / len(densities[-2:]))
        axes.set_xlabel("vehicles per km and lane")
        axes.set_ylabel("packet reception rate [%]")
        known = [100 * p.prr.value for p in points if p.prr is not None]
        axes.set_ylim(max(-2.0, 10.0 * math.floor(min(known, default=0.0) / 10.0) - 2.0), 102.0)
        axes.set_xticks(densities)
        runs = _runs([point.n for point in points])
        figure.legend(loc="outside right upper", title=f"{runs} per point,\nbars: 95 %")
        write(figure, path)


def _runs(counts: Sequence[int]) -> str:
    """How many runs there are, in words."""
    least, most = min(counts, default=0), max(counts, default=0)
    return f"{most} runs" if least == most else f"{least} to {most} runs"


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


def _draw_published(axes: Axes, methods: Sequence[str], place: float) -> None:
    """Draw the paper's averages as lines, each with its name at `place`."""
    known = [method for method in methods if method in TABLE_2]
    for method in known:
        look = looks([method])[method]
        prr = 100 * TABLE_2[method].prr
        axes.axhline(prr, color=look.colour, lw=1.0, ls=":", zorder=1)
        axes.annotate(
            f"paper: {look.name}", (place, prr), xytext=(0, -2), textcoords="offset points",
            ha="center", va="top", fontsize=SMALL, color=look.colour,
        )  # fmt: skip
    if known:
        axes.plot([], [], color=BLACK, lw=1.0, ls=":", label="paper's average\n(Table II)")


def draw_distribution(steps: Sequence[Step], path: Path) -> None:
    """Draw Figure 8 to `path` without suffix: all methods together, and each with its band.

    Most rates are near 100 %; below `_BREAK` the scale is another one, on a grey ground.
    """
    methods = list(dict.fromkeys(step.method for step in steps))
    curves = {m: _curve([step for step in steps if step.method == m]) for m in methods}
    rows = math.ceil((len(methods) + 1) / _COLUMNS)
    with styled():
        figure = Figure(figsize=(WIDTH, 1.75 * rows + 1.0), layout="constrained")
        grid = figure.subplots(rows, _COLUMNS, sharex=True, sharey=True, squeeze=False).ravel()
        for method, look in looks(list(curves)).items():
            _draw_curve(grid[0], curves[method], look)
        grid[0].set_title("all methods")
        for axes, (method, look) in zip(grid[1:], looks(methods).items(), strict=False):
            _draw_one(axes, curves, method, look)
        for axes in grid[: len(methods) + 1]:
            _scale(axes)
        for axes in grid[len(methods) + 1 :]:
            axes.set_axis_off()
        grid[0].set_ylim(-0.02, 1.02)
        runs = _runs([step.n for step in steps])
        figure.supxlabel(
            f"packet reception rate of a run [%], {runs} of each method\n"
            f"grey: below {_BREAK:g} %, drawn {_SHRUNK:g} times smaller",
            fontsize=9.0,
        )
        figure.supylabel("share of runs with at most that", fontsize=9.0)
        figure.legend(handles=_about(looks(methods)), loc="outside upper center", ncols=4)
        write(figure, path)


def _about(shown: Mapping[str, Look]) -> list[Line2D | Patch]:
    """What the legend of Figure 8 says."""
    methods = [
        Line2D([], [], color=look.colour, marker=look.marker, lw=1.5, ms=3.5, label=look.name)
        for look in shown.values()
    ]
    return [
        *methods,
        Line2D([], [], color=BLACK, lw=1.0, ls=":", label="paper's average (Table II)"),
        Line2D([], [], color=_PALE, lw=0.7, label="other methods"),
        Patch(facecolor=GREY, alpha=0.3, lw=0, label="band of 95 %"),
    ]


def _scale(axes: Axes) -> None:
    """Give rates above `_BREAK` more room than those below it, and show where that changes."""
    axes.set_xscale("function", functions=(_placed, _unplaced))
    axes.axvspan(0.0, _BREAK, facecolor=LIGHT, alpha=0.4, lw=0, zorder=0)
    axes.set_xlim(0.0, 100.5)
    axes.set_xticks([0.0, 25.0, 50.0, 75.0, 80.0, 85.0, 90.0, 95.0, 100.0])
    axes.minorticks_off()


def _placed(rate: Array) -> Array:
    return np.where(rate < _BREAK, rate / _SHRUNK, rate - _BREAK + _BREAK / _SHRUNK)


def _unplaced(place: Array) -> Array:
    low = _BREAK / _SHRUNK
    return np.where(place < low, place * _SHRUNK, place - low + _BREAK)


def _curve(steps: Sequence[Step]) -> Array:
    """The corners of the steps, from 0 to 100 %, float64, shape (corner, 4).

    Columns: rate [%], and share, lower and upper end of the band, 0 to 1 each.
    """
    start = [0.0, 0.0, 0.0, min(1.0, band(steps[0].n))]
    corners = [[100 * step.prr, step.share, step.share_low, step.share_high] for step in steps]
    corners = [start, *corners, [100.0, *corners[-1][1:]]]
    return np.asarray(corners, np.float64)


def _draw_one(axes: Axes, curves: dict[str, Array], method: str, look: Look) -> None:
    for other, curve in curves.items():
        if other != method:
            axes.step(curve[:, 0], curve[:, 1], where="post", color=_PALE, lw=0.7, zorder=1)
    curve = curves[method]
    axes.fill_between(
        curve[:, 0], curve[:, 2], curve[:, 3], step="post", color=look.colour, alpha=0.3, lw=0
    )
    _draw_curve(axes, curve, look)
    if method in TABLE_2:
        axes.axvline(100 * TABLE_2[method].prr, color=look.colour, lw=1.0, ls=":")
    axes.set_title(look.name)


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
