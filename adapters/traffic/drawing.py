"""A picture of a scene from above: roads, buildings, lights, and everybody on the road."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from adapters.traffic.bodies import Body
from adapters.traffic.geometry import Boxes, Float
from orchestrator.drawing import styled
from orchestrator.palette import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    GROUND,
    LIGHT,
    ORANGE,
    PURPLE,
    SKY,
    VERMILLION,
)
from orchestrator.signal import Array, Signal, Signals

_WIDTH: Final = 10.0
"""The width of the picture [inch]."""

_MARGIN: Final = 0.03
"""Around everything, as a share of the larger side."""

_SMALLEST: Final = 4e-3
"""Bodies shorter than this share of the larger side of the scene are drawn as marks, too."""

_COLOURS: Final[Mapping[Body, str]] = {
    Body.CAR: BLUE,
    Body.SUV: SKY,
    Body.VAN: PURPLE,
    Body.BUS: ORANGE,
    Body.TRUCK: BLACK,
    Body.RAIL: GREY,
    Body.MOTORCYCLE: "#8A6D3B",
    Body.BICYCLE: GREEN,
    Body.PEDESTRIAN: VERMILLION,
}
_LIGHTS: Final = (GREY, VERMILLION, VERMILLION, ORANGE, "#7FCEB9", GREEN, VERMILLION)
"""Colours by the codes of `light.state`."""


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
    figure = Figure(figsize=(_WIDTH, _WIDTH * float(np.clip(span[1] / span[0], 0.3, 1.4)) + 0.8))
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    margin = _MARGIN * float(span.max())
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
    _bodies(axes, arrays, names, float(span.max()))
    figure.tight_layout()
    return figure


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
    colours = [_LIGHTS[code] for code in arrays["light.state"].tolist()]
    axes.scatter(place[:, 0], place[:, 1], s=6, c=colours, linewidths=0, zorder=3)


def _bodies(axes: Axes, arrays: Mapping[str, Array], names: Mapping[int, str], span: float) -> None:
    center, heading = arrays["vehicle.position"][:, :2], arrays["vehicle.heading"]
    size, body = arrays["vehicle.size"][:, :2], arrays["vehicle.body"]
    numbers = arrays["vehicle.id"].tolist()
    present = []
    for kind, colour in _COLOURS.items():
        rows = np.flatnonzero(body == kind)
        if not len(rows):
            continue
        present.append(Patch(color=colour, label=f"{kind.name.lower()} ({len(rows)})"))
        boxes = Boxes(center=center[rows], heading=heading[rows], size=size[rows]).corners()
        axes.add_collection(PolyCollection(list(boxes), facecolors=colour, zorder=4))
        small = rows[size[rows].max(axis=1) < _SMALLEST * span]
        axes.scatter(center[small, 0], center[small, 1], s=5, c=colour, linewidths=0, zorder=4)
    carries = np.flatnonzero(arrays["vehicle.lidar"])
    axes.scatter(
        center[carries, 0], center[carries, 1], s=60, facecolors="none", edgecolors="black",
        linewidths=0.8, zorder=5,
    )  # fmt: skip
    for row, number in enumerate(numbers):
        if number in names:
            axes.annotate(
                names[number], center[row], xytext=(4, 4), textcoords="offset points",
                fontsize=8, color=VERMILLION, zorder=6, annotation_clip=True,
            )  # fmt: skip
    if present:
        axes.legend(
            handles=present, loc="upper left", bbox_to_anchor=(1.0, 1.0), fontsize=8,
            frameon=False, title="circle: lidar", title_fontsize=8,
        )  # fmt: skip
