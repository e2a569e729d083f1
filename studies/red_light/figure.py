"""One figure of a red-light run: the scene at the decisive moment, time lines under it."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final, TypeAlias

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PatchCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Polygon, Rectangle
from matplotlib.transforms import Bbox

from fmus.messages.apm import Apm, decode, split
from fmus.messages.records import LINKS, NO_VEHICLE, OUTCOMES
from orchestrator.drawing import styled, write
from orchestrator.palette import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    GROUND,
    LIGHT,
    LINK_COLOURS,
    PURPLE,
    SKY,
    VERMILLION,
)
from studies.red_light.metrics import Metrics
from studies.red_light.roles import BLOCKING, COLLISION, EGO, ROADSIDE, SHARING
from studies.red_light.traces import Scene, Traces

ROLE_COLOURS: Final = {
    EGO: BLUE,
    COLLISION: VERMILLION,
    SHARING: GREEN,
    BLOCKING: GREY,
}
ROLE_NAMES: Final = {
    EGO: "ego",
    COLLISION: "collision vehicle",
    SHARING: "lidar sharing node",
    BLOCKING: "blocking vehicle",
}
ROADSIDE_MARKER: Final[Mapping[str, Any]] = {"marker": "^", "color": PURPLE, "markersize": 9}
_LINK_COLOURS: Final = tuple(LINK_COLOURS[name] for name in LINKS)
_RECEIVED: Final = OUTCOMES.index("R")
_DPI: Final = 110
_VIEW: Final = 60.0  # drawn at least around the ego [m]

Links: TypeAlias = Mapping[tuple[int, int], np.void]
"""Receptions by transmitter and receiver."""


def draw(traces: Traces, metrics: Metrics, path: Path) -> None:
    """Write the figure as a PNG to `path`."""
    with styled():
        write(_drawn(traces, metrics), path.with_suffix(""), (".png",), dpi=_DPI)


def _drawn(traces: Traces, metrics: Metrics) -> Figure:
    moment = decisive_moment(metrics, traces)
    links = _links(traces, moment)
    view = _view(traces.scene(moment), links)
    height = 10.0 * view.height / view.width
    figure = Figure(figsize=(11.0, height + 6.0), layout="constrained")
    grid = figure.add_gridspec(4, 1, height_ratios=(height, 1.6, 1.6, 1.6))
    axes = figure.add_subplot(grid[0])
    _draw_scene(axes, traces, moment, links)
    axes.set_xlim(*view.intervalx)
    axes.set_ylim(*view.intervaly)
    axes.set_title(_title(metrics, moment))
    lines = [figure.add_subplot(grid[row]) for row in (1, 2, 3)]
    _draw_motion(lines[0], traces)
    _draw_power(lines[1], traces, traces.vehicle_with(EGO))
    _draw_packets(lines[2], traces, traces.vehicle_with(EGO))
    for axes in lines:
        axes.axvline(moment / 1e9, color=BLACK, linewidth=0.8, linestyle=":")
        axes.set_xlim(0.0, traces.end / 1e9)
    lines[-1].set_xlabel("simulated time [s]")
    return figure


def decisive_moment(metrics: Metrics, traces: Traces) -> int:
    """When the ego first braked for a hazard, else when the bodies were closest [ns]."""
    moment: float | None = metrics.braking.time
    if moment is None:
        moment = metrics.min_gap_time
    if moment is None:
        return traces.end
    return round(moment * 1e9)


def _title(metrics: Metrics, moment: int) -> str:
    """What the picture shows, in one line."""
    braking = metrics.braking
    what = (
        f"the ego brakes for vehicle {braking.object}, seen by vehicle {braking.seen_by}"
        if braking.time is not None
        else "ego and collision vehicle are closest"
    )
    return f"t = {moment / 1e9:.2f} s: {what}"


def _view(now: Scene, links: Links) -> Bbox:
    """The part of the scene to draw: around the ego, with the ends of links unless far."""
    row = now.row(EGO)
    middle = now.position[row, :2] if row is not None else np.zeros(2)
    linked = {vehicle for ends in links for vehicle in ends}
    points = [p[:2] for v, p in zip(now.ids, now.position, strict=True) if int(v) in linked]
    wide, most = _VIEW * np.array([1.2, 1.0]), _VIEW * np.array([1.6, 1.2])
    low = np.min([middle - wide, *points], axis=0) - 5.0
    high = np.max([middle + wide, *points], axis=0) + 5.0
    return Bbox([np.maximum(low, middle - most), np.minimum(high, middle + most)])


def _draw_scene(axes: Axes, traces: Traces, moment: int, links: Links) -> None:
    now = traces.scene(moment)
    matched = _matched_apm(traces, moment)
    if matched is not None:
        _draw_apm(axes, matched)
    _draw_buildings(axes, traces, moment)
    _draw_blind_zones(axes, traces, now, moment)
    _draw_vehicles(axes, now, {vehicle for ends in links for vehicle in ends})
    _draw_links(axes, now, links)
    axes.set_aspect("equal")
    axes.grid(visible=False)
    axes.set_xlabel("x, east [m]")
    axes.set_ylabel("y, north [m]")
    axes.legend(
        handles=_legend(now), loc="upper left", fontsize="small", frameon=True, framealpha=0.9
    )


def _legend(now: Scene) -> list[Patch | Line2D]:
    vehicles: list[Patch | Line2D] = [
        Patch(facecolor=colour, label=ROLE_NAMES[role]) for role, colour in ROLE_COLOURS.items()
    ]
    if ROADSIDE in now.role:
        vehicles.append(Line2D([], [], linestyle="", label="roadside unit", **ROADSIDE_MARKER))
    links = [
        Line2D([], [], color=colour, label=f"link {name}")
        for name, colour in zip(LINKS, _LINK_COLOURS, strict=True)
    ]
    zones = [
        Patch(facecolor=SKY, alpha=0.5, label="APM of the matched sharer"),
        Patch(fill=False, edgecolor=PURPLE, hatch="///", label="blind zone of the ego"),
    ]
    return [*vehicles, *links, *zones]


def _draw_buildings(axes: Axes, traces: Traces, moment: int) -> None:
    vertex = np.asarray(traces.at("traffic.building.vertex", moment))
    index = np.asarray(traces.at("traffic.building.index", moment))
    rings = [Polygon(vertex[index == building]) for building in np.unique(index)]
    axes.add_collection(PatchCollection(rings, facecolor=LIGHT, edgecolor=GROUND))


def _draw_vehicles(axes: Axes, now: Scene, linked: set[int]) -> None:
    for corners, role, vehicle in zip(now.corners(), now.role, now.ids, strict=True):
        if int(role) == ROADSIDE:
            axes.plot(*corners.mean(axis=0), **ROADSIDE_MARKER)
            continue
        colour = ROLE_COLOURS.get(int(role), LIGHT)
        axes.add_patch(Polygon(corners, facecolor=colour, edgecolor=BLACK, linewidth=0.5))
        if int(role) in {EGO, COLLISION, SHARING} or int(vehicle) in linked:
            axes.annotate(str(vehicle), corners.mean(axis=0), ha="center", va="center", fontsize=6)


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


def _draw_blind_zones(axes: Axes, traces: Traces, now: Scene, moment: int) -> None:
    """The squares lie along the ego's heading."""
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
                alpha=0.5,
            )
        )


def _links(traces: Traces, moment: int) -> Links:
    """The links of sensor data in the second before `moment`: the last reception on each."""
    heard = traces.receptions
    heard = heard[(heard["time"] <= moment) & (heard["time"] > moment - 1_000_000_000)]
    heard = heard[(heard["addressed"] == 1) | (heard["receiver"] == traces.vehicle_with(EGO))]
    return {(int(event["transmitter"]), int(event["receiver"])): event for event in heard}


def _draw_links(axes: Axes, now: Scene, links: Links) -> None:
    place = {int(v): p[:2] for v, p in zip(now.ids, now.position, strict=True)}
    for (transmitter, receiver), event in links.items():
        if transmitter in place and receiver in place:
            ends = np.stack([place[transmitter], place[receiver]])
            axes.plot(
                *ends.T,
                color=_LINK_COLOURS[int(event["link"])],
                linewidth=2.0,
                linestyle="-" if event["outcome"] == _RECEIVED else "--",
            )
            if not np.isnan(event["power_dbm"]):  # known; a replayed recording need not say it
                axes.annotate(
                    f"{event['power_dbm']:.0f} dBm",
                    ends.mean(axis=0),
                    fontsize=7,
                    bbox={"boxstyle": "round,pad=0.1", "facecolor": "white", "alpha": 0.7},
                    annotation_clip=True,
                )


def _draw_motion(axes: Axes, traces: Traces) -> None:
    times, speed = traces.scalars("traffic.ego.speed")
    axes.plot(times, speed * 3.6, color=ROLE_COLOURS[EGO], label="ego speed [km/h]")
    gap = traces.gap_to_hidden
    axes.plot(
        gap[:, 0],
        gap[:, 1],
        color=ROLE_COLOURS[COLLISION],
        label="gap to the collision vehicle [m]",
    )
    axes.set_ylim(0.0, 60.0)
    axes.legend(loc="upper left", fontsize="small")


def _draw_power(axes: Axes, traces: Traces, ego: int | None) -> None:
    heard = traces.receptions
    direct = heard[(heard["hop"] == 0) & (heard["receiver"] == ego)]
    relayed = heard[(heard["hop"] == 1) & (heard["receiver"] == ego) & (heard["addressed"] == 1)]
    for rows, marker, name in ((direct, "o", "direct link"), (relayed, "^", "from the relay")):
        colours = [_LINK_COLOURS[link] for link in rows["link"]]
        axes.scatter(
            rows["time"] / 1e9, rows["power_dbm"], c=colours, marker=marker, s=10, label=name
        )
    axes.set_ylabel("at the ego [dBm]")
    if len(heard):
        axes.legend(loc="upper left", fontsize="small")


def _draw_packets(axes: Axes, traces: Traces, ego: int | None) -> None:
    """Sensor data that the ego got and did not get, on its own and over the relay."""
    heard = traces.receptions
    heard = heard[heard["receiver"] == ego]
    for level, rows in enumerate((heard[heard["hop"] == 0], heard[heard["hop"] > 0])):
        good = rows["outcome"] == _RECEIVED
        axes.plot(rows["time"][good] / 1e9, np.full(good.sum(), level), "|", color=GREEN)
        axes.plot(rows["time"][~good] / 1e9, np.full((~good).sum(), level), "x", color=VERMILLION)
    times, relay = traces.scalars("relay.relay")
    changes = np.flatnonzero(np.diff(relay, prepend=NO_VEHICLE))
    for k in changes:
        name = "direct" if relay[k] == NO_VEHICLE else f"relay {relay[k]}"
        axes.annotate(name, (times[k], 1.4), fontsize=7)
    axes.set_yticks([0, 1], ["direct", "relayed"])
    axes.set_ylim(-0.5, 2.0)
