"""Figures 9 and 10: collision rate over packet error rate."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from studies.collision.condition import CONSTANT, USUAL_AGE
from studies.collision.published import (
    COMPRESSION_32_RATE,
    MOHED_PER,
    MOHED_RATE,
)
from studies.method.style import looks, styled, write

_COLOURS: Final = {16: "#0072B2", 32: "#D55E00"}
_OTHER: Final = "#666666"

_DODGE: Final = 0.8
"""Between compressions at the same packet error rate [points], so that no bar hides another."""

_RANGES: Final = ((-3.0, 103.0), (-0.3, 10.3))
"""Of the collision rate [%]: all, and those that a good method is about."""

Rows = Sequence[Mapping[str, Any]]


def draw(rows: Rows, path: Path) -> None:
    """Draw to `path`, without suffix: a column per speed, all rates above, small ones below.

    Args:
        rows: of `rates.rows`, of the points of `curves`; at least one.
        path: without suffix.
    """
    speeds = sorted({row["speed_kmh"] for row in rows}, reverse=True)
    relays = list(dict.fromkeys(r["relay"] for r in rows if r["channel"] != CONSTANT))
    with styled():
        figure = Figure(figsize=(2.4 + 4.0 * len(speeds), 6.4), layout="constrained")
        panels = figure.subplots(
            len(_RANGES), len(speeds), sharex=True, sharey="row", squeeze=False,
            height_ratios=(3, 2),
        )  # fmt: skip
        for row, limits in zip(panels, _RANGES, strict=True):
            for axes, speed in zip(row, speeds, strict=True):
                _draw_speed(axes, [row for row in rows if row["speed_kmh"] == speed], relays)
                _draw_published(axes)
                axes.set_ylim(*limits)
            row[0].set_ylabel("collision rate [%]")
        for axes, speed in zip(panels[0], speeds, strict=True):
            axes.set_title(f"ego at {speed:g} km/h", fontsize=9)
        for axes in panels[-1]:
            axes.axhline(100 * MOHED_RATE, color="black", lw=0.8, ls=":", zorder=1)
            axes.set_xlabel("packet error rate, end to end [%]")
            axes.set_xlim(-3.0, 103.0)
        _legend(figure, panels[0])
        write(figure, path)


def _draw_speed(axes: Axes, rows: Rows, relays: list[str]) -> None:
    compressions = sorted({row["compression"] for row in rows})
    for k, compression in enumerate(compressions):
        shift = (k - (len(compressions) - 1) / 2) * _DODGE
        colour = _COLOURS.get(compression, _OTHER)
        own = [row for row in rows if row["compression"] == compression]
        for age in sorted({row["maximum_age"] for row in own}, reverse=True):
            curve = [r for r in own if r["channel"] == CONSTANT and r["maximum_age"] == age]
            label = f"constant PER, compression {compression}"
            if age == USUAL_AGE:
                _draw_constant(axes, curve, colour=colour, line="-", label=label)
            else:
                label = f"{label},\nscans of the last {age:g} s"
                _draw_constant(axes, curve, colour=colour, line="--", label=label)
        for relay, look in looks(relays).items():
            points = [r for r in own if r["channel"] != CONSTANT and r["relay"] == relay]
            label = f"{look.name}, compression {compression}"
            _draw_points(axes, points, shift, colour=colour, marker=look.marker, label=label)


def _draw_constant(axes: Axes, rows: Rows, *, colour: str, line: str, label: str) -> None:
    if not rows:
        return
    rows = sorted(rows, key=lambda row: row["per"])
    x = [100 * row["per"] for row in rows]
    low, high = ([100 * row[name] for row in rows] for name in ("low", "high"))
    axes.fill_between(x, low, high, color=colour, alpha=0.15, lw=0)
    rates = [100 * row["rate"] for row in rows]
    axes.plot(
        x, rates, color=colour, lw=1.2, ls=line, marker=".", markersize=4.0, label=label, zorder=2
    )


def _draw_points(
    axes: Axes, rows: Rows, shift: float, *, colour: str, marker: str, label: str
) -> None:
    known = [row for row in rows if row["per"] is not None and row["rate"] is not None]
    if not known:
        return
    axes.errorbar(
        [100 * row["per"] + shift for row in known],
        [100 * row["rate"] for row in known],
        xerr=_bars(known, "per", "per_low", "per_high"),
        yerr=_bars(known, "rate", "low", "high"),
        color=colour,
        marker=marker,
        markersize=6.0,
        markeredgecolor="white",
        linestyle="",
        elinewidth=1.0,
        capsize=2.5,
        label=label,
        zorder=3,
    )


def _bars(rows: Rows, name: str, low: str, high: str) -> list[list[float]]:
    """Lengths of the error bars below and above [%]; none where there is no interval."""
    below = [100 * max(0.0, r[name] - r[low]) if r[low] is not None else 0.0 for r in rows]
    above = [100 * max(0.0, r[high] - r[name]) if r[high] is not None else 0.0 for r in rows]
    return [below, above]


def _draw_published(axes: Axes) -> None:
    """The two points that the paper names in its text."""
    style: dict[str, Any] = {"color": "black", "linestyle": "", "fillstyle": "none", "zorder": 4}
    axes.plot(
        [100 * MOHED_PER],
        [100 * MOHED_RATE],
        marker=7,  # points down: less than this
        label="paper: MoHeD, less than 1 %",
        **style,
    )
    label = "paper: compression 32, no losses"
    axes.plot([0.0], [100 * COMPRESSION_32_RATE], marker="s", label=label, **style)


def _legend(figure: Figure, panels: Sequence[Axes]) -> None:
    """One for all panels."""
    entries: dict[str, Any] = {}
    for axes in panels:
        handles, labels = axes.get_legend_handles_labels()
        entries |= dict(zip(labels, handles, strict=True))
    figure.legend(entries.values(), entries.keys(), loc="outside right upper", fontsize=8)
