"""A picture of a scene from above: roads, buildings, lights, and everybody on the road."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from matplotlib.legend import Legend
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.patheffects import withStroke
from matplotlib.transforms import ScaledTranslation

from adapters.traffic.bodies import Body
from adapters.traffic.colours import BODY_COLOURS, LIGHT_COLOURS
from adapters.traffic.geometry import Boxes, Float
from orchestrator.drawing import SMALL, WIDTH, styled
from orchestrator.palette import BLACK, GREEN, GROUND, LIGHT
from orchestrator.signal import Array, Signal, Signals

DPI: Final = 171
"""Pixels per inch of a picture in pixels: it is 1300 wide."""

_AROUND: Final = 0.75
"""What the axis and its numbers take of the width [inch]."""

_BESIDE: Final = 1.15
"""What the title and the axis take of the height [inch]."""

_COLUMNS: Final = 5
"""How many kinds stand side by side in the legend."""

_LINE: Final = 0.22
"""The height of a line of the legend [inch]."""

_MARGIN: Final = 0.03
"""Around everything, as a share of the larger side."""

_EDGE: Final = 0.85
"""From this share of the width on, names stand to the left."""

_BELOW: Final = 0.48
"""How far the legend is below the scene, beneath its axis [inch]."""

_SMALLEST: Final = 4e-3
"""Bodies shorter than this share of the larger side of the scene are drawn as marks, too."""

_HATCHES: Final[Mapping[Body, str]] = {
    Body.SUV: "xxx",
    Body.VAN: "...",
    Body.BUS: "///",
    Body.RAIL: "---",
    Body.MOTORCYCLE: "+++",
}
"""What bodies have beside their colour where they are large enough, for readers without colours."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class View:
    """A square of a scene, as far as there is something.

    Attributes:
        center: of the square [m], shape (2,).
        radius: half its side [m].
    """

    center: Float
    radius: float


def draw(
    signals: Signals, names: Mapping[int, str], title: str, around: View | None = None
) -> Figure:
    """A picture of a source of traffic at one instant.

    Args:
        signals: its outputs; `light.*` may be absent.
        names: labels of some, by their numbers: those of the declared entities.
        title: above the picture.
        around: what to draw of it; everything by default.
    """
    with styled():
        return _drawn(signals, names, title, around)


def _drawn(signals: Signals, names: Mapping[int, str], title: str, around: View | None) -> Figure:
    arrays = {name: np.asarray(signal) for name, signal in signals.items() if _is_array(signal)}
    low, high = _bounds(arrays)
    if around is not None:
        reach = np.array([around.radius, around.radius])
        low, high = np.maximum(low, around.center - reach), np.minimum(high, around.center + reach)
    span = np.maximum(high - low, 10.0)
    margin = _MARGIN * float(span.max())
    body = _bodies_within(arrays, low - margin, low + span + margin)
    kinds = [kind for kind in BODY_COLOURS if (body == kind).any()]
    shape = float(np.clip(span[1] / span[0], 0.1, 1.2))
    lines = 1 + -(-len(kinds) // _COLUMNS)
    height = (WIDTH - _AROUND) * shape + _BESIDE + _LINE * lines
    figure = Figure(figsize=(WIDTH, height), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    axes.set_xlim(low[0] - margin, low[0] + span[0] + margin)
    axes.set_ylim(low[1] - margin, low[1] + span[1] + margin)
    axes.set_aspect("equal")
    axes.grid(visible=False)
    axes.set_xlabel("x [m]")
    axes.set_ylabel("y [m]")
    axes.set_title(title, loc="left")
    _polygons(axes, arrays, "road", LIGHT)
    _polygons(axes, arrays, "building", GROUND)
    _lights(axes, arrays)
    _bodies(axes, arrays, float(span.max()))
    _names(axes, arrays, names)
    _legends(figure, axes, arrays, body)
    return figure


def _bodies_within(arrays: Mapping[str, Array], low: Float, high: Float) -> Array:
    """The kinds of those whose middle is between two corners, shape (vehicle,)."""
    place = arrays["vehicle.position"][:, :2]
    return np.asarray(arrays["vehicle.body"][((low <= place) & (place <= high)).all(axis=1)])


def _is_array(signal: Signal) -> bool:
    return not isinstance(signal, bytes)


def _bounds(arrays: Mapping[str, Array]) -> tuple[Float, Float]:
    """The corners of everything [m], shapes (2,)."""
    parts = [arrays["road.vertex"], arrays["building.vertex"], arrays["vehicle.position"][:, :2]]
    points = np.concatenate([part.reshape(-1, 2) for part in parts])
    return (points.min(axis=0), points.max(axis=0)) if len(points) else (np.zeros(2), np.ones(2))


def _polygons(axes: Axes, arrays: Mapping[str, Array], group: str, colour: str) -> None:
    vertex, index = arrays[f"{group}.vertex"], arrays[f"{group}.index"]
    cuts = np.flatnonzero(np.diff(index)) + 1
    rings = [ring for ring in np.split(vertex, cuts) if len(ring)]
    axes.add_collection(PolyCollection(rings, facecolors=colour, edgecolors="none"))


def _lights(axes: Axes, arrays: Mapping[str, Array]) -> None:
    place = arrays.get("light.position")
    if place is None or not len(place):
        return
    colours = [LIGHT_COLOURS[code] for code in arrays["light.state"].tolist()]
    axes.scatter(place[:, 0], place[:, 1], s=6, c=colours, linewidths=0, zorder=3)


def _bodies(axes: Axes, arrays: Mapping[str, Array], span: float) -> None:
    center, heading = arrays["vehicle.position"][:, :2], arrays["vehicle.heading"]
    size, body = arrays["vehicle.size"][:, :2], arrays["vehicle.body"]
    for kind, colour in BODY_COLOURS.items():
        rows = np.flatnonzero(body == kind)
        if not len(rows):
            continue
        boxes = Boxes(center=center[rows], heading=heading[rows], size=size[rows]).corners()
        hatch = _HATCHES.get(kind) if size[rows].max() >= _SMALLEST * span * 4 else None
        axes.add_collection(
            PolyCollection(
                list(boxes), facecolors=colour, edgecolors="white", linewidths=0.0, hatch=hatch,
                zorder=4,
            )
        )  # fmt: skip
        small = rows[size[rows].max(axis=1) < _SMALLEST * span]
        axes.scatter(center[small, 0], center[small, 1], s=5, c=colour, linewidths=0, zorder=4)
    carries = np.flatnonzero(arrays["vehicle.lidar"])
    axes.scatter(
        center[carries, 0], center[carries, 1], s=60, facecolors="none", edgecolors=BLACK,
        linewidths=0.8, zorder=5,
    )  # fmt: skip


def _names(axes: Axes, arrays: Mapping[str, Array], names: Mapping[int, str]) -> None:
    """Write names beside bodies, away from the right edge, and from those just above."""
    center = arrays["vehicle.position"][:, :2]
    low, high = axes.get_xlim()
    near = np.array([0.08 * (high - low), 0.12 * np.ptp(axes.get_ylim())])
    halo = [withStroke(linewidth=2.5, foreground="white")]  # names are read above dark bodies
    for row, number in enumerate(arrays["vehicle.id"].tolist()):
        if number in names:
            is_right = bool(center[row, 0] > low + _EDGE * (high - low))
            away = center - center[row]
            is_below = bool(((abs(away) < near).all(axis=1) & (away[:, 1] > 0)).any())
            axes.annotate(
                names[number], center[row],
                xytext=(-7 if is_right else 7, -7 if is_below else 7),
                textcoords="offset points", ha="right" if is_right else "left",
                va="top" if is_below else "baseline", fontsize=9, color=BLACK, zorder=6,
                annotation_clip=True, path_effects=halo,
            )  # fmt: skip


def _legends(figure: Figure, axes: Axes, arrays: Mapping[str, Array], body: Array) -> None:
    """Draw the legends below the picture: kinds seen, with their numbers, and what is around."""
    kinds = [
        Patch(
            facecolor=colour, hatch=_HATCHES.get(kind), edgecolor="white", lw=0,
            label=f"{kind.name.lower()} ({(body == kind).sum()})",
        )
        for kind, colour in BODY_COLOURS.items()
        if (body == kind).any()
    ]  # fmt: skip
    if kinds:
        _legend(figure, axes, kinds, _BELOW)
    around: list[Patch | Line2D] = [
        Patch(facecolor=colour, label=group)
        for group, colour in (("road", LIGHT), ("building", GROUND))
        if len(arrays[f"{group}.index"])
    ]
    if arrays["vehicle.lidar"].any():
        label = "vehicle with lidar"
        around.append(Line2D([], [], ls="", marker="o", ms=7, mfc="none", mec=BLACK, label=label))
    if len(arrays.get("light.position", ())):
        label = "traffic light, in its colour"
        around.append(Line2D([], [], ls="", marker=".", color=GREEN, label=label))
    if around:
        rows = -(-len(kinds) // _COLUMNS)
        _legend(figure, axes, around, _BELOW + rows * _LINE)


def _legend(figure: Figure, axes: Axes, handles: Sequence[Patch | Line2D], below: float) -> None:
    """Draw a legend that begins where the axis does, so far below the scene [inch]."""
    down = ScaledTranslation(0.0, -below, figure.dpi_scale_trans)
    legend = Legend(
        axes, handles, [str(each.get_label()) for each in handles], loc="upper left",
        bbox_to_anchor=(0.0, 0.0), borderaxespad=0.0, bbox_transform=axes.transAxes + down,
        ncols=_COLUMNS, fontsize=SMALL,
    )  # fmt: skip
    axes.add_artist(legend)
    legend.set_clip_on(False)  # else the layout leaves no room for it
