"""One figure of a red-light run: the scene at the decisive moment, time lines beside it."""

from collections.abc import Sequence
from pathlib import Path
from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fmus.messages.records import LINKS
from orchestrator.drawing import SMALL, styled, write
from orchestrator.palette import BLACK, BLUE, GREEN, LINK_COLOURS, VERMILLION
from orchestrator.signal import Array
from studies.red_light.metrics import Metrics
from studies.red_light.roles import EGO
from studies.red_light.top_view import RECEIVED, draw_scene, links_before, view_of
from studies.red_light.traces import Traces

_DPI: Final = 150
_WIDE: Final = 8.2
"""The width of the figure [inch]."""

_HIGH: Final = 6.6
"""The height of a scene that has the time lines beside it, and of the time lines [inch]."""

_LOW: Final = 5.6
"""The height of time lines below a scene [inch]."""

_LINES: Final = 4
_FILLS: Final = ("full", "none", "bottom")
"""How marks of each of `LINKS` are filled, for readers without colours."""

_APART: Final = 0.07
"""Names of relays nearer than this share of the axis are not written twice."""


def draw(traces: Traces, metrics: Metrics, path: Path) -> None:
    """Write the figure as a PNG to `path`."""
    with styled():
        write(_drawn(traces, metrics), path.with_suffix(""), (".png",), dpi=_DPI)


def _drawn(traces: Traces, metrics: Metrics) -> Figure:
    moment = decisive_moment(metrics, traces)
    links = links_before(traces, moment)
    view = view_of(traces.scene(moment), links)
    figure, scene, lines = _layout(view.width / view.height)
    draw_scene(scene, traces, moment, links)
    figure.suptitle(_title(metrics, moment), fontsize=10.0)
    ego = traces.vehicle_with(EGO)
    _draw_speed(lines[0], traces)
    _draw_gap(lines[1], traces, metrics)
    _draw_power(lines[2], traces, ego)
    _draw_packets(lines[3], traces, ego)
    for axes in lines:
        axes.axvline(moment / 1e9, color=BLACK, linewidth=0.8, linestyle=":")
        axes.set_xlim(0.0, traces.end / 1e9)
        axes.tick_params(labelbottom=axes is lines[-1])
    lines[-1].set_xlabel("simulated time [s]; dotted: the moment of the picture")
    figure.align_ylabels(lines)
    return figure


def _layout(shape: float) -> tuple[Figure, Axes, Sequence[Axes]]:
    """A figure with room for a scene and time lines: side by side if the scene is upright.

    Args:
        shape: width over height of the scene.
    """
    if shape < 1.2:
        figure = Figure(figsize=(_WIDE, _HIGH), layout="constrained")
        wide = min(max(shape, 0.65), 0.95)
        grid = figure.add_gridspec(_LINES, 2, width_ratios=(wide, 1.0))
        scene = figure.add_subplot(grid[:, 0], anchor="N")
        return figure, scene, [figure.add_subplot(grid[row, 1]) for row in range(_LINES)]
    height = max(_WIDE / shape, 1.5)
    figure = Figure(figsize=(_WIDE, height + _LOW), layout="constrained")
    grid = figure.add_gridspec(1 + _LINES, 1, height_ratios=(height, *[_LOW / _LINES] * _LINES))
    scene = figure.add_subplot(grid[0])
    return figure, scene, [figure.add_subplot(grid[1 + row]) for row in range(_LINES)]


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


def _draw_speed(axes: Axes, traces: Traces) -> None:
    times, speed = traces.scalars("traffic.ego.speed")
    axes.plot(times, speed * 3.6, color=BLUE)
    axes.set_ylim(bottom=0.0)
    axes.set_ylabel("speed of\nthe ego [km/h]")


def _draw_gap(axes: Axes, traces: Traces, metrics: Metrics) -> None:
    gap = traces.gap_to_hidden
    axes.plot(gap[:, 0], gap[:, 1], color=VERMILLION)
    axes.set_ylim(bottom=0.0)
    axes.set_ylabel("gap to the\ncollider [m]")
    if metrics.min_gap_m is not None and metrics.min_gap_time is not None:
        place = (metrics.min_gap_time, metrics.min_gap_m)
        axes.plot(*place, "o", color=VERMILLION, markersize=4.0)
        axes.annotate(
            f"least: {metrics.min_gap_m:.2f} m", place, xytext=(0, 14), textcoords="offset points",
            ha="center" if place[0] < 0.9 * traces.end / 1e9 else "right", fontsize=SMALL,
        )  # fmt: skip


def _draw_power(axes: Axes, traces: Traces, ego: int | None) -> None:
    """Powers at the ego: the mark says by which way, its filling and colour the class of link."""
    heard = traces.receptions
    direct = heard[(heard["hop"] == 0) & (heard["receiver"] == ego)]
    relayed = heard[(heard["hop"] == 1) & (heard["receiver"] == ego) & (heard["addressed"] == 1)]
    for rows, marker, way in ((direct, "o", "direct"), (relayed, "^", "by relay")):
        for k, name in enumerate(LINKS):
            own = rows[rows["link"] == k]
            if len(own):
                axes.plot(
                    own["time"] / 1e9, own["power_dbm"], marker, color=LINK_COLOURS[name],
                    fillstyle=_FILLS[k], markersize=3.5, markeredgewidth=0.7,
                    label=f"{way}, {name}",
                )  # fmt: skip
    axes.set_ylabel("power at\nthe ego [dBm]")
    _legend_above(axes)


def _draw_packets(axes: Axes, traces: Traces, ego: int | None) -> None:
    """Sensor data that the ego got and did not get, on its own and over the relay."""
    heard = traces.receptions
    heard = heard[heard["receiver"] == ego]
    relayed = heard[heard["hop"] > 0]
    level = np.where(heard["hop"] > 0, 1.0, 0.0)
    good = heard["outcome"] == RECEIVED
    time = heard["time"] / 1e9
    if good.any():
        axes.plot(time[good], level[good], "|", color=GREEN, markersize=7.0, label="received")
    if not good.all():
        axes.plot(time[~good], level[~good], "x", color=VERMILLION, markersize=5.0, label="lost")
    _name_relays(axes, relayed, traces.end / 1e9)
    axes.set_yticks([0, 1, 2], ["direct", "by relay", "relay"])
    axes.tick_params(axis="y", length=0)
    axes.set_ylim(-0.5, 2.5)
    axes.grid(visible=False, axis="y")
    axes.set_ylabel("sensor data\nfor the ego")
    _legend_above(axes)


def _name_relays(axes: Axes, relayed: Array, end: float) -> None:
    """Write who forwarded, where that begins, above what it forwarded."""
    own = relayed[relayed["addressed"] == 1]
    before, place = None, -end
    for row in own:
        time = float(row["time"]) / 1e9
        if row["transmitter"] != before and time - place > _APART * end:
            axes.text(time, 2.0, str(row["transmitter"]), fontsize=SMALL, va="center")
            before, place = row["transmitter"], time


def _legend_above(axes: Axes) -> None:
    """Put a legend above the axes, where no data are."""
    handles, labels = axes.get_legend_handles_labels()
    if handles:
        axes.legend(
            handles, labels, loc="lower right", bbox_to_anchor=(1.0, 0.97), ncols=len(labels),
            columnspacing=1.0, handletextpad=0.2, borderaxespad=0.0,
        )  # fmt: skip
