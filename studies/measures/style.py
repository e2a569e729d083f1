"""How the panels of all measures look."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Final

import numpy as np

from orchestrator.palette import COLOURS, LINK_COLOURS
from orchestrator.signal import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_DISTANCE: Final = "distance [m]"


def draw_shares(axes: "Axes", rows: Mapping[str, tuple[Array, Array, Array, Array]]) -> None:
    """Draw shares over distance with their intervals.

    Args:
        axes: to draw into.
        rows: by name, places [m], shares and bounds below and above, shape (bin,) each.
    """
    for name, (place, share, low, high) in rows.items():
        known = ~np.isnan(share)
        if known.any():
            colour = LINK_COLOURS.get(name, COLOURS[0])
            axes.plot(place[known], share[known], ".-", color=colour, label=name, lw=1.0)
            axes.fill_between(place[known], low[known], high[known], color=colour, alpha=0.2, lw=0)
    axes.set_xlabel(_DISTANCE)
    axes.set_ylim(-0.02, 1.02)
    if axes.lines:
        axes.legend(fontsize="small")


def draw_survival(axes: "Axes", curve: tuple[Array, Array]) -> None:
    """Draw what share of something has happened by a time.

    Args:
        axes: to draw into.
        curve: times [s], ascending, and shares, shape (n,) each.
    """
    place, share = curve
    axes.step(np.append(0.0, place), np.append(0.0, share), where="post", color=COLOURS[0], lw=1.0)
    axes.set_xlabel("time since first hidden [s]")
    axes.set_ylabel("share of road users known")
    axes.set_xlim(left=0.0)
    axes.set_ylim(-0.02, 1.02)


def draw_quantiles(axes: "Axes", table: Mapping[str, Array], label: str) -> None:
    """Draw median, mean and 95th percentile over distance.

    Args:
        axes: to draw into.
        table: columns of `studies.measures.bins.spread_by_bin`, shape (bin,) each.
        label: of the values; milliseconds are their unit.
    """
    place = (table["from_m"] + table["to_m"]) / 2
    for column, colour, style in (
        ("median", COLOURS[0], ".-"),
        ("mean", COLOURS[2], ".--"),
        ("p95", COLOURS[1], ".-"),
    ):
        values = table[f"{column}_s"] * 1e3
        known = ~np.isnan(values)
        axes.plot(place[known], values[known], style, color=colour, label=column, lw=1.0)
    axes.set_xlabel(_DISTANCE)
    axes.set_ylabel(f"{label} [ms]")
    axes.set_ylim(bottom=0.0)
    axes.legend(fontsize="small")


def draw_distribution(axes: "Axes", values: Mapping[str, Array], label: str) -> None:
    """Draw empirical distribution functions.

    Args:
        axes: to draw into.
        values: by name, shape (n,).
        label: of the values, with their unit.
    """
    for (name, each), colour in zip(values.items(), COLOURS * len(values), strict=False):
        if len(each):
            ordered = np.sort(each)
            step = max(1, len(ordered) // 2000)  # more would not be seen
            share = np.arange(1, len(ordered) + 1) / len(ordered)
            axes.step(
                ordered[::step], share[::step], where="post", color=colour, label=name, lw=1.0
            )
    axes.set_xlabel(label)
    axes.set_ylabel("share")
    axes.set_ylim(-0.02, 1.02)
    if axes.lines:
        axes.legend(fontsize="small")
