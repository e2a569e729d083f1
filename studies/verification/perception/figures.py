"""Figures of a verification: two scenes, blind zones, sharers, bytes."""

from collections.abc import Iterator, Sequence
from typing import Any, Final

import numpy as np
import shapely
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import PathPatch
from matplotlib.path import Path as Outline
from shapely.geometry import Polygon
from shapely.geometry.base import BaseGeometry
from shapely.geometry.polygon import orient

from orchestrator.palette import BLUE, COLOURS, GREEN, GREY, LIGHT, ORANGE, VERMILLION
from studies.verification.drawing import Drawing
from studies.verification.perception.parameter_set import (
    RECOMMENDED,
    SHARER_CURVES,
    ZONE_CURVES,
    Curve,
)
from studies.verification.perception.scoring import Played, zone_area
from studies.verification.perception.summary import (
    ALWAYS,
    DEMANDED,
    WHOLE,
    byte_share,
    traffic,
    zone_areas,
)
from studies.verification.perception.verification import DATA_SIZES, TARGET_BYTES, Verification

_EGO, _SHARER, _BEST, _HIDDEN = BLUE, GREEN, ORANGE, VERMILLION
_HALF: Final = 58.0
"""Half the side of the part of a scene that is drawn [m], at least."""
_SEAM: Final = 0.01
"""Gaps between blind zones that are not drawn [m]."""
_LINES: Final = {DEMANDED: "-", WHOLE: "--"}
_MARKERS: Final = {DEMANDED: "o", WHOLE: "^", ALWAYS: "s"}


def drawings(verification: Verification) -> Iterator[Drawing]:
    """Draw everything that `verification` has data for."""
    if verification.examples:
        caption = (
            "Scenes with the recommended parameters: road (grey), houses (dark), what is "
            "hidden from the ego vehicle (red), its blind zones (outlines) and route (blue), "
            "candidates (white), the chosen sharer (green) and, if it is another one, the best "
            "(orange)."
        )
        yield Drawing(name="scenes.png", caption=caption, figure=_scenes(verification.examples))
    caption = (
        "Blind zones against the hidden road over T1, for several ranges of window sizes: "
        "precision solid, recall dashed, IoU dotted. T1 is a number of points per cell, or a "
        "share of its ground that is seen."
    )
    yield Drawing(name="zones.png", caption=caption, figure=_zones(verification))
    caption = (
        "Share of scenes with the right sharer (interval of 95 %), and without a trigger though "
        "somebody reveals something (dashed), when one of the recommended parameters varies."
    )
    yield Drawing(name="sharers.png", caption=caption, figure=_sharers(verification))
    caption = (
        "Left: bytes of APMM over those of always-on sharing, by the number of candidates, with "
        "what was demanded as answer (solid) and with whole scans (dashed); the line is the "
        "target. Right: bytes per scan and hidden road that becomes known."
    )
    yield Drawing(name="bytes.png", caption=caption, figure=_bytes(verification))


def _scenes(examples: Sequence[Played]) -> Figure:
    count = len(examples)
    figure = Figure(figsize=(5.5 * count, 5.6), layout="constrained")
    for k, played in enumerate(examples):
        _scene(figure.add_subplot(1, count, k + 1), played)
    return figure


def _scene(axes: Axes, played: Played) -> None:
    scene, truth = played.scene, played.truth
    match = played.matches[RECOMMENDED.name]
    ego = scene.by_id[scene.ego]
    _fill(axes, scene.road, color=LIGHT, lw=0)
    for house in scene.buildings:
        _fill(axes, Polygon(house.ring), color=GREY, lw=0)
    _fill(axes, truth.hidden, color=_HIDDEN, alpha=0.45, lw=0)
    zones = zone_area(match, ego.heading).buffer(_SEAM, join_style="mitre")
    _fill(axes, zones, facecolor="none", edgecolor="black", lw=0.8)
    axes.plot(*scene.route.T, color=_EGO, lw=1.2)
    best = max(truth.areas, key=lambda one: truth.areas[one])
    colours = dict.fromkeys(scene.candidates, "white") | {best: _BEST, scene.ego: _EGO}
    if match.sharers:
        colours[match.sharers[0]] = _SHARER
    for one in scene.vehicles:
        colour = colours.get(one.id, "#bbbbbb")
        _fill(axes, one.footprint, facecolor=colour, edgecolor="black", lw=0.8)
    x, y = ego.position
    shown = [scene.by_id[one].position for one in (best, *match.sharers[:1])]
    half = max(_HALF, *(max(abs(a - x), abs(b - y)) + 6 for a, b in shown))
    axes.set_xlim(x - half, x + half)
    axes.set_ylim(y - half, y + half)
    axes.set_aspect("equal")
    told = f"{truth.areas[match.sharers[0]]:.0f}" if match.sharers else "0"
    axes.set_title(
        f"scene {played.result.number}: sharer reveals {told} of at most {truth.best:.0f} m$^2$",
        fontsize=10,
    )


def _fill(axes: Axes, area: BaseGeometry, **style: Any) -> None:
    for part in shapely.get_parts(area):
        if isinstance(part, Polygon):
            turned = orient(part)  # holes the other way round, so that they stay empty
            rings = (turned.exterior, *turned.interiors)
            outlines = [Outline(np.array(ring.coords), closed=True) for ring in rings]
            axes.add_patch(PathPatch(Outline.make_compound_path(*outlines), **style))


def _zones(verification: Verification) -> Figure:
    panels = list(dict.fromkeys(curve.panel for curve in ZONE_CURVES))
    figure = Figure(figsize=(11, 3.8), layout="constrained")
    for k, panel in enumerate(panels):
        axes = figure.add_subplot(1, len(panels), k + 1)
        curves = [curve for curve in ZONE_CURVES if curve.panel == panel]
        for colour, curve in zip(COLOURS, curves, strict=False):
            areas = [zone_areas(verification.results, one.name) for one in curve.sets.values()]
            x = list(curve.sets)
            axes.plot(x, [a.precision for a in areas], "o-", ms=3, color=colour, label=curve.label)
            axes.plot(x, [a.recall for a in areas], "o--", ms=3, color=colour)
            axes.plot(x, [a.iou for a in areas], ":", color=colour)
        axes.set_ylim(0, 1)
        axes.set_title(f"cells of {panel}", fontsize=10)
        if curves[0].parameter == "threshold":
            axes.set_xscale("log")
        values = list(curves[0].sets)
        axes.set_xticks(values, [f"{value:g}" for value in values])
        axes.minorticks_off()
        axes.set_xlabel("T1")
        axes.legend(fontsize=7, title="windows", title_fontsize=7)
    return figure


def _sharers(verification: Verification) -> Figure:
    columns = 4
    rows = -(-len(SHARER_CURVES) // columns)
    figure = Figure(figsize=(13, 2.7 * rows), layout="constrained")
    for k, curve in enumerate(SHARER_CURVES):
        _sharer_panel(figure.add_subplot(rows, columns, k + 1), verification, curve)
    figure.supylabel("share of scenes", fontsize=10)
    return figure


def _sharer_panel(axes: Axes, verification: Verification, curve: Curve) -> None:
    scores = [verification.score(one) for one in curve.sets.values()]
    x = np.arange(len(scores))
    right = np.array([one.right for one in scores])
    low = right - [one.right_low for one in scores]
    high = np.array([one.right_high for one in scores]) - right
    axes.errorbar(x, right, np.maximum([low, high], 0), fmt="o-", ms=4, color=_SHARER)
    axes.plot(x, [one.missed for one in scores], "o--", ms=3, color=_HIDDEN)
    axes.set_xticks(x, [f"{value:g}" for value in curve.sets])
    axes.set_ylim(0, 1)
    axes.set_title(curve.panel, fontsize=10)


def _bytes(verification: Verification) -> Figure:
    figure = Figure(figsize=(11, 3.8), layout="constrained")
    _share_panel(figure.add_subplot(1, 2, 1), verification)
    _gain_panel(figure.add_subplot(1, 2, 2), verification)
    return figure


def _share_panel(axes: Axes, verification: Verification) -> None:
    groups = verification.by_candidates()
    for colour, (size, data) in zip(COLOURS, DATA_SIZES.items(), strict=False):
        for way, line in _LINES.items():
            shares = [byte_share(group, RECOMMENDED.name, data, way) for group in groups.values()]
            label = size if way == DEMANDED else None
            axes.plot(list(groups), shares, f"o{line}", ms=4, color=colour, label=label)
    for way, line in _LINES.items():
        axes.plot([], [], line, color="black", label=way)
    axes.axhline(TARGET_BYTES, color="black", lw=0.7, ls=":", label="target")
    axes.set_ylim(0, None)
    axes.set_xlabel("candidates")
    axes.set_ylabel("bytes, APMM / always-on")
    axes.legend(fontsize=8)


def _gain_panel(axes: Axes, verification: Verification) -> None:
    count = len(verification.results)
    for colour, (size, data) in zip(COLOURS, DATA_SIZES.items(), strict=False):
        ways = traffic(verification.results, RECOMMENDED.name, data)
        for way, marker in _MARKERS.items():
            one = ways[way]
            axes.plot(one.bytes / count, (one.area or 0.0) / count, marker, color=colour)
        axes.plot([], [], lw=4, color=colour, label=size)
    for way, marker in _MARKERS.items():
        axes.plot([], [], marker, color="black", label=way)
    axes.set_xscale("log")
    axes.set_ylim(0, 1.15 * axes.get_ylim()[1])
    axes.set_xlabel("bytes per scan")
    axes.set_ylabel("revealed [m$^2$ per scene]")
    axes.legend(fontsize=8, ncols=2, loc="lower right")
