"""The scene of a red-light run from above: who is where, who hears whom, what is hidden."""

from collections.abc import Iterator, Mapping
from typing import Any, Final, TypeAlias

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PatchCollection
from matplotlib.lines import Line2D
from matplotlib.patches import FancyArrowPatch, Patch, Polygon, Rectangle
from matplotlib.patheffects import withStroke
from matplotlib.transforms import Bbox, ScaledTranslation

from fmus.messages.apm import Apm, decode, split
from fmus.messages.records import LINKS, OUTCOMES
from orchestrator.drawing import SMALL
from orchestrator.palette import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    GROUND,
    LINK_COLOURS,
    LINK_LINES,
    PURPLE,
    SKY,
    VERMILLION,
)
from studies.red_light.roles import BLOCKING, COLLISION, EGO, ROADSIDE, SHARING
from studies.red_light.traces import Array, Scene, Traces

RECEIVED: Final = OUTCOMES.index("R")

_NAMED: Final = {
    EGO: ("ego", BLUE),
    COLLISION: ("collider", VERMILLION),
    SHARING: ("sharer", GREEN),
}
"""Who has a name in the picture, and a colour."""

_RELAY: Final = SKY
_ROADSIDE: Final[Mapping[str, Any]] = {"marker": "^", "color": PURPLE, "markersize": 9.0}
_MARGIN: Final = 12.0
"""Around everybody that matters [m]."""

_APART: Final = 0.04
"""Names on one side are farther apart than this share of the height of the scene."""

_BELOW: Final = 0.5
"""How far the legend is below the scene, beneath its axis [inch]."""

_PLACE: Final = 0.6
"""Where on a link its power stands, from the sender on, as a share of its length."""

_LEAST: Final = 60.0
"""The picture is at least so wide and high [m]."""

Links: TypeAlias = Mapping[tuple[int, int], np.void]
"""Receptions by transmitter and receiver."""


def links_before(traces: Traces, moment: int) -> Links:
    """The links of sensor data in the second before `moment` [ns]: the last reception on each."""
    heard = traces.receptions
    heard = heard[(heard["time"] <= moment) & (heard["time"] > moment - 1_000_000_000)]
    heard = heard[(heard["addressed"] == 1) | (heard["receiver"] == traces.vehicle_with(EGO))]
    return {(int(event["transmitter"]), int(event["receiver"])): event for event in heard}


def view_of(now: Scene, links: Links) -> Bbox:
    """The part of the scene to draw [m]: everybody with a name, and both ends of all links."""
    linked = {vehicle for ends in links for vehicle in ends}
    wanted = [
        place[:2]
        for vehicle, role, place in zip(now.ids, now.role, now.position, strict=True)
        if int(vehicle) in linked or int(role) in _NAMED
    ] or [np.zeros(2)]
    low, high = np.min(wanted, axis=0) - _MARGIN, np.max(wanted, axis=0) + _MARGIN
    more = np.maximum(_LEAST - (high - low), 0.0) / 2
    return Bbox([low - more, high + more])


def draw_scene(axes: Axes, traces: Traces, moment: int, links: Links) -> None:
    """Draw who is where at `moment` [ns], with the `links` before it."""
    now = traces.scene(moment)
    matched = _matched_apm(traces, moment)
    if matched is not None:
        _draw_apm(axes, matched)
    _draw_buildings(axes, traces, moment)
    has_zones = _draw_blind_zones(axes, traces, now, moment)
    _draw_links(axes, now, links)
    _draw_vehicles(axes, now, links)
    view = view_of(now, links)
    axes.set_xlim(*view.intervalx)
    axes.set_ylim(*view.intervaly)
    axes.set_aspect("equal")
    axes.grid(visible=False)
    axes.set_xlabel("x, east [m]")
    axes.set_ylabel("y, north [m]")
    handles = [*_about_vehicles(now), *_about_links(links)]
    if has_zones:
        handles.append(Patch(fill=False, edgecolor=PURPLE, hatch="///", label="ego's blind zone"))
    if matched is not None:
        handles.append(
            Patch(
                facecolor=SKY,
                alpha=0.5,
                label="matched sharer's matrix (APM):\ndarker where it has more points",
            )
        )
    below = ScaledTranslation(0.0, -_BELOW, axes.figure.dpi_scale_trans)
    axes.legend(
        handles=handles, loc="upper left", bbox_to_anchor=(0.0, 0.0), borderaxespad=0.0,
        bbox_transform=axes.transAxes + below, ncols=3 if view.width > view.height else 1,
    )  # fmt: skip


def _about_vehicles(now: Scene) -> Iterator[Patch | Line2D]:
    """What the legend says of those who have no name in the picture."""
    if BLOCKING in now.role:
        yield Patch(facecolor=GREY, edgecolor=BLACK, label="blocking vehicle")
    yield Patch(facecolor="white", edgecolor=BLACK, label="other vehicle")
    if ROADSIDE in now.role:
        yield Line2D([], [], linestyle="", label="roadside unit", **_ROADSIDE)


def _about_links(links: Links) -> Iterator[Line2D]:
    """What the legend says of the classes that occur, and of what was lost."""
    found = {int(event["link"]) for event in links.values()}
    for k, name in enumerate(LINKS):
        if k in found:
            label = f"sensor data, {name}"
            yield Line2D([], [], color=LINK_COLOURS[name], ls=LINK_LINES[name], lw=2.0, label=label)
    if any(event["outcome"] != RECEIVED for event in links.values()):
        yield Line2D([], [], color=BLACK, marker="x", linestyle="", label="the last one was lost")


def _draw_buildings(axes: Axes, traces: Traces, moment: int) -> None:
    vertex = np.asarray(traces.at("traffic.building.vertex", moment))
    index = np.asarray(traces.at("traffic.building.index", moment))
    rings = [Polygon(vertex[index == building]) for building in np.unique(index)]
    axes.add_collection(PatchCollection(rings, facecolor=GROUND, edgecolor="none"))


def _draw_vehicles(axes: Axes, now: Scene, links: Links) -> None:
    relays = {transmitter for transmitter, _ in links} & {receiver for _, receiver in links}
    view = view_of(now, links)
    middle = view.x0 + view.width / 2
    names: list[tuple[bool, float]] = []
    for corners, role, vehicle in zip(now.corners(), now.role.tolist(), now.ids, strict=True):
        center = corners.mean(axis=0)
        name, colour = _NAMED.get(role, ("relay", _RELAY))
        is_named = role in _NAMED or int(vehicle) in relays
        if role == ROADSIDE:
            axes.plot(*center, **_ROADSIDE)
        else:
            other = GREY if role == BLOCKING else "white"
            face = colour if is_named else other
            body = Polygon(corners, facecolor=face, edgecolor=BLACK, linewidth=0.6, zorder=3)
            axes.add_patch(body)
        if is_named:
            is_left = bool(center[0] < middle)
            if any(
                left == is_left and abs(y - center[1]) < _APART * view.height for left, y in names
            ):
                is_left = not is_left  # so that the one does not lie on the other
            names.append((is_left, float(center[1])))
            _name(axes, f"{name} {vehicle}", corners, is_left=is_left)


def _name(axes: Axes, text: str, corners: Array, *, is_left: bool) -> None:
    """Write a name beside a body, away from the middle of the picture, legible on everything."""
    side = corners[:, 0].min() if is_left else corners[:, 0].max()
    axes.annotate(
        text,
        (side, corners[:, 1].mean()),
        xytext=(-3 if is_left else 3, 0),
        textcoords="offset points",
        ha="right" if is_left else "left",
        va="center",
        fontweight="bold",
        zorder=6,
        annotation_clip=True,
        path_effects=[withStroke(linewidth=2.5, foreground="white")],
    )


def _matched_apm(traces: Traces, moment: int) -> Apm | None:
    """The APM that the best sharer last sent, if there is a match."""
    sharer = int(np.asarray(traces.at("perception.match.sharer", moment))[0])
    for message in split(bytes(traces.at("perception.apms", moment))):
        apm = decode(message)
        if apm.vehicle == sharer:
            return apm
    return None


def _draw_apm(axes: Axes, apm: Apm) -> None:
    indices = np.moveaxis(np.indices(apm.cells.shape), 0, -1)[..., None, :]
    square = np.array([[0, 0], [1, 0], [1, 1], [0, 1]])
    corners = apm.world(indices + square).reshape(-1, 4, 2)
    cells = PatchCollection([Polygon(c) for c in corners], cmap="Blues", alpha=0.5)
    cells.set_array(np.log1p(apm.cells.ravel().astype(float)))
    axes.add_collection(cells)


def _draw_blind_zones(axes: Axes, traces: Traces, now: Scene, moment: int) -> bool:
    """Draw squares along the ego's heading, if there are any."""
    (heading,) = now.heading[now.ids == traces.vehicle_with(EGO)]
    centers = np.asarray(traces.at("perception.blind_zone.center", moment))
    ranges = np.asarray(traces.at("perception.blind_zone.range", moment))
    for center, half in zip(centers[ranges > 0], ranges[ranges > 0], strict=True):
        axes.add_patch(
            Rectangle(
                tuple(center - half),
                2 * half,
                2 * half,
                angle=np.degrees(heading),
                rotation_point="center",
                fill=False,
                edgecolor=PURPLE,
                hatch="///",
                linewidth=0.6,
                alpha=0.6,
            )
        )
    return bool((ranges > 0).any())


def _draw_links(axes: Axes, now: Scene, links: Links) -> None:
    place = {int(v): p[:2] for v, p in zip(now.ids, now.position, strict=True)}
    for (transmitter, receiver), event in links.items():
        if transmitter not in place or receiver not in place:
            continue
        name = LINKS[int(event["link"])]
        arrow = FancyArrowPatch(
            tuple(place[transmitter]), tuple(place[receiver]), arrowstyle="-", shrinkA=0, shrinkB=0,
            color=LINK_COLOURS[name], linestyle=LINK_LINES[name], linewidth=2.0, zorder=4,
        )  # fmt: skip
        axes.add_patch(arrow)
        _draw_power(axes, place[transmitter], place[receiver], event)


def _draw_power(axes: Axes, start: Array, end: Array, event: np.void) -> None:
    """Write onto a link how strong it was, and a cross if it was lost."""
    middle = start + _PLACE * (end - start)
    is_lost = event["outcome"] != RECEIVED
    if is_lost:
        axes.plot(*middle, "x", color=BLACK, markersize=9.0, markeredgewidth=2.0, zorder=5)
    if not np.isnan(event["power_dbm"]):  # known; a replayed recording need not say it
        axes.annotate(
            f"{event['power_dbm']:.0f} dBm".replace("-", "\N{MINUS SIGN}"),
            (middle[0], middle[1]),
            xytext=(0, 10 if is_lost else 0),
            textcoords="offset points",
            ha="center",
            va="center",
            fontsize=SMALL,
            zorder=5,
            bbox={"boxstyle": "round,pad=0.15", "facecolor": "white", "edgecolor": "none"},
            annotation_clip=True,
        )
