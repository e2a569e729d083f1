"""How the panels of all measures look."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Final, TypeAlias

import numpy as np

from orchestrator.palette import COLOURS, LINK_COLOURS, LINK_LINES, LINK_MARKERS
from orchestrator.signal import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_DISTANCE: Final = "distance [m]"
LINES: Final = ("-", "--", ":", "-.")
"""Lines of series beside their colours, for readers without them."""


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
            line, marker = LINK_LINES.get(name, "-"), LINK_MARKERS.get(name, ".")
            axes.plot(
                place[known], share[known], line, marker=marker, color=colour, label=name, lw=1.0,
                ms=3.5,
            )  # fmt: skip
            axes.fill_between(place[known], low[known], high[known], color=colour, alpha=0.2, lw=0)
    axes.set_xlabel(_DISTANCE)
    axes.set_ylim(-0.02, 1.02)
    if axes.lines:
        axes.legend()


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
        ("median", COLOURS[0], "o-"),
        ("mean", COLOURS[2], "s--"),
        ("p95", COLOURS[1], "^:"),
    ):
        values = table[f"{column}_s"] * 1e3
        known = ~np.isnan(values)
        axes.plot(place[known], values[known], style, color=colour, label=column, lw=1.0, ms=3.5)
    axes.set_xlabel(_DISTANCE)
    axes.set_ylabel(f"{label} [ms]")
    axes.set_ylim(bottom=0.0)
    axes.legend()


Distribution: TypeAlias = tuple[Array, Array]
"""Values, ascending, and the share of all that are not greater, shape (point,) each."""


def distribution(ordered: Array) -> Distribution:
    """The empirical distribution of values that ascend, shape (n,), as far as it can be seen."""
    step = max(1, len(ordered) // 2000)
    rows = np.arange(0, len(ordered), step)
    return ordered[rows], (rows + 1) / max(len(ordered), 1)


def draw_distribution(axes: "Axes", curves: Mapping[str, Distribution], label: str) -> None:
    """Draw empirical distribution functions.

    Args:
        axes: to draw into.
        curves: by name.
        label: of the values, with their unit.
    """
    for k, (name, (values, share)) in enumerate(curves.items()):
        if len(values):
            colour, line = COLOURS[k % len(COLOURS)], LINES[k % len(LINES)]
            axes.step(values, share, ls=line, where="post", color=colour, label=name, lw=1.2)
    axes.set_xlabel(label)
    axes.set_ylabel("share")
    axes.set_ylim(-0.02, 1.02)
    if axes.lines:
        axes.legend()
