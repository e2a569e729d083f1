"""Figures of a verification: two scenes, blind zones, sharers, bytes."""

from collections.abc import Iterator, Sequence
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, PathPatch
from matplotlib.path import Path as Outline
from matplotlib.ticker import FixedLocator, NullFormatter, StrMethodFormatter

from orchestrator.drawing import WIDTH
from orchestrator.palette import (
    BLACK,
    BLUE,
    COLOURS,
    GREEN,
    GREY,
    GROUND,
    LIGHT,
    ORANGE,
    VERMILLION,
)
from studies.verification.drawing import Drawing
from studies.verification.perception.shown import (
    BEST,
    CANDIDATE,
    EGO,
    OTHER,
    SHARER,
    Area,
    Example,
    SharerCurve,
    Shown,
    ZoneCurve,
)
from studies.verification.perception.summary import ALWAYS, DEMANDED, WHOLE

_BODIES: Final[dict[str, dict[str, Any]]] = {
    EGO: {"facecolor": BLUE},
    SHARER: {"facecolor": GREEN, "hatch": "xxxx"},
    BEST: {"facecolor": ORANGE, "hatch": "...."},
    CANDIDATE: {"facecolor": "white"},
    OTHER: {"facecolor": GREY},
}
_HIDDEN: Final = VERMILLION
_HALF: Final = 58.0
"""Half the side of the part of a scene that is drawn [m], at least."""

_LINES: Final = {DEMANDED: "-", WHOLE: "--", ALWAYS: ":"}
_MARKERS: Final = "o^sDv"
_QUALITIES: Final = ("precision", "recall", "IoU")


def drawings(shown: Shown) -> Iterator[Drawing]:
    """Draw everything that there are data for."""
    if shown.examples:
        caption = (
            "Scenes with the recommended parameters: what is hidden from the ego vehicle in "
            "truth, and its blind zones, which should cover that. The best sharer is drawn where "
            "another one was chosen."
        )
        yield Drawing(name="scenes.png", caption=caption, figure=_scenes(shown.examples))
    caption = (
        f"Blind zones against the hidden road of {shown.scenes} scenes over T1, for several "
        "ranges of window sizes. T1 is a number of points per cell, or a share of its ground that "
        "is seen. Precision is the share of the zones that is hidden, recall the share of what is "
        "hidden that is in zones, IoU what is both over what is either."
    )
    yield Drawing(name="zones.png", caption=caption, figure=_zones(shown.zones))
    caption = (
        f"Share of the {shown.wanted} scenes with something to reveal, with intervals of 95 %, "
        "when one of the recommended parameters varies."
    )
    yield Drawing(name="sharers.png", caption=caption, figure=_sharers(shown.sharers))
    caption = (
        "Left: bytes of APMM over those of always-on sharing, by the number of candidates. Right: "
        f"bytes per scan, and hidden road that becomes known, on average of {shown.scenes} scenes."
    )
    yield Drawing(name="bytes.png", caption=caption, figure=_bytes(shown))


def _scenes(examples: Sequence[Example]) -> Figure:
    figure = Figure(figsize=(WIDTH, 4.7), layout="constrained")
    panels = figure.subplots(1, len(examples), squeeze=False)[0]
    for axes, one in zip(panels, examples, strict=True):
        _scene(axes, one)
    present = {body.role for one in examples for body in one.bodies}
    figure.legend(
        handles=[
            *(
                Patch(label=role, edgecolor=BLACK, lw=0.6, **look)
                for role, look in _BODIES.items()
                if role in present
            ),
            Line2D([], [], color=BLUE, lw=1.2, label="route of the ego"),
            Patch(facecolor=_HIDDEN, alpha=0.45, label="hidden road"),
            Patch(fill=False, edgecolor=BLACK, lw=0.8, ls="--", label="blind zones"),
            Patch(facecolor=GROUND, hatch="///", edgecolor="white", lw=0, label="building"),
        ],
        loc="outside lower center",
        ncols=5,
    )
    return figure


def _scene(axes: Axes, one: Example) -> None:
    _fill(axes, one.road, facecolor=LIGHT, lw=0)
    _fill(axes, one.buildings, facecolor=GROUND, hatch="///", edgecolor="white", lw=0)
    _fill(axes, one.hidden, facecolor=_HIDDEN, alpha=0.45, lw=0)
    axes.plot(*np.array(one.route).T, color=BLUE, lw=1.2)
    for body in one.bodies:
        _fill(axes, body.area, edgecolor=BLACK, lw=0.6, **_BODIES[body.role])
    _fill(axes, one.zones, fill=False, edgecolor=BLACK, lw=0.8, ls="--")
    x, y = one.route[0]
    corners = [
        corner for body in one.bodies if body.role in (SHARER, BEST) for corner in body.area[0][0]
    ]
    half = max(_HALF, *(max(abs(a - x), abs(b - y)) + 3 for a, b in corners))
    axes.set_xlim(x - half, x + half)
    axes.set_ylim(y - half, y + half)
    axes.set_aspect("equal")
    axes.grid(visible=False)
    axes.set_xlabel("x [m]")
    axes.set_ylabel("y [m]")
    axes.set_title(
        f"scene {one.number}: the sharer reveals {one.told:.0f} m$^2$\nof at most {one.best:.0f}"
    )


def _fill(axes: Axes, area: Area, **style: Any) -> None:
    for rings in area:
        outlines = [Outline(np.array(ring), closed=True) for ring in rings]
        axes.add_patch(PathPatch(Outline.make_compound_path(*outlines), **style))


def _zones(curves: Sequence[ZoneCurve]) -> Figure:
    titles = list(dict.fromkeys(curve.panel for curve in curves))
    figure = Figure(figsize=(WIDTH, 6.4), layout="constrained")
    grid = figure.subplots(len(_QUALITIES), len(titles), sharey=True, sharex="col", squeeze=False)
    for column, title in zip(grid.T, titles, strict=True):
        own = [curve for curve in curves if curve.panel == title]
        for k, curve in enumerate(own):
            for axes, values in zip(
                column, (curve.precision, curve.recall, curve.iou), strict=True
            ):
                axes.plot(
                    curve.threshold, values, ls="-", marker=_MARKERS[k], ms=4.5, lw=1.2,
                    color=COLOURS[k], label=curve.windows,
                )  # fmt: skip
        column[0].set_title(f"cells of {title}")
        is_count = own[0].threshold[-1] > 1
        if is_count:
            column[0].set_xscale("log")
        column[0].set_xticks(own[0].threshold, [f"{value:g}" for value in own[0].threshold])
        column[0].minorticks_off()
        column[-1].set_xlabel("T1 [points]" if is_count else "T1 [share of the ground]")
        column[0].legend(title="windows", loc="lower left")
    for row, name in zip(grid, _QUALITIES, strict=True):
        row[0].set_ylabel(name)
    grid[0, 0].set_ylim(0.0, 1.02)
    return figure


def _sharers(curves: Sequence[SharerCurve]) -> Figure:
    columns = 4
    rows = -(-len(curves) // columns)
    figure = Figure(figsize=(WIDTH, 2.1 * rows + 0.3), layout="constrained")
    for k, curve in enumerate(curves):
        axes = figure.add_subplot(rows, columns, k + 1)
        x = np.arange(len(curve.values))
        right = np.array(curve.right)
        bars = np.maximum([right - curve.low, np.array(curve.high) - right], 0)
        axes.errorbar(
            x, 100 * right, 100 * bars, fmt="o-", ms=4, capsize=2.5, lw=1.2, color=GREEN,
            label="the right sharer was chosen",
        )  # fmt: skip
        axes.plot(
            x, 100 * np.array(curve.missed), "^--", ms=4, lw=1.2, color=VERMILLION,
            label="nobody was asked",
        )  # fmt: skip
        axes.set_xticks(x, [f"{value:g}" for value in curve.values])
        axes.set_ylim(-3.0, 103.0)
        axes.set_xlabel(curve.parameter)
        axes.tick_params(labelleft=k % columns == 0)
    figure.supylabel("share of scenes [%]", fontsize=9.0)
    figure.legend(*axes.get_legend_handles_labels(), loc="outside upper right", ncols=2)
    return figure


def _bytes(shown: Shown) -> Figure:
    figure = Figure(figsize=(WIDTH, 3.6), layout="constrained")
    left, right = figure.subplots(1, 2)
    sizes = list(dict.fromkeys(cost.size for cost in shown.costs))
    looks = {size: (COLOURS[k], _MARKERS[k]) for k, size in enumerate(sizes)}
    for cost in shown.costs:
        colour, marker = looks[cost.size]
        if cost.shares:
            left.plot(
                cost.candidates, 100 * np.array(cost.shares), _LINES[cost.way], marker=marker,
                ms=4, lw=1.2, color=colour,
            )  # fmt: skip
        right.plot(cost.bytes / 1e3, cost.revealed, marker, ms=6, color=colour)
    for way, line in _LINES.items():
        own = [cost for cost in shown.costs if cost.way == way]
        order = sorted(own, key=lambda cost: cost.bytes)
        x, y = [cost.bytes / 1e3 for cost in order], [cost.revealed for cost in order]
        right.plot(x, y, line, color=BLACK, lw=0.8, zorder=1)
    left.axhline(100 * shown.target, color=BLACK, lw=0.8, ls="-.")
    left.set_yscale("log")
    left.yaxis.set_major_locator(FixedLocator([0.5, 1, 2, 5, 10, 20, 50]))
    left.yaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
    left.yaxis.set_minor_formatter(NullFormatter())
    left.set_xlabel("candidates")
    left.set_ylabel("bytes over those of always-on [%]")
    right.set_xscale("log")
    right.xaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
    right.set_ylim(0, 1.15 * right.get_ylim()[1])
    right.set_xlabel("bytes per scan [kB]")
    right.set_ylabel("road that becomes known [m$^2$ per scene]")
    figure.legend(
        handles=[
            *(
                Line2D([], [], ls="", marker=marker, color=colour, label=size)
                for size, (colour, marker) in looks.items()
            ),
            *(Line2D([], [], ls=line, color=BLACK, label=way) for way, line in _LINES.items()),
            Line2D([], [], ls="-.", lw=0.8, color=BLACK, label="target"),
        ],
        loc="outside upper center",
        ncols=4,
    )
    return figure
