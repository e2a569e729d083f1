"""Figure 7: packet reception rate over the density of traffic."""

from pathlib import Path
from typing import Any, Final

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from studies.method.style import Look, looks, styled, write
from studies.relay import density
from studies.relay.paper import TABLE_2
from studies.relay.sample import METHOD, Study

_DODGE: Final = 0.25
"""Between methods at the same density [vehicles per km and lane], so that no bar hides another."""


def draw(study: Study, path: Path) -> None:
    """Draw Figure 7 to `path`, without suffix."""
    points = density.rows(study)
    methods = list(dict.fromkeys(point[METHOD] for point in points))
    with styled():
        figure = Figure(figsize=(7.2, 4.2), layout="constrained")
        axes = figure.add_subplot()
        for k, (method, look) in enumerate(looks(methods).items()):
            shift = (k - (len(methods) - 1) / 2) * _DODGE
            _draw_method(axes, [p for p in points if p[METHOD] == method], look, shift)
            if method in TABLE_2:
                axes.axhline(100 * TABLE_2[method].prr, color=look.colour, lw=0.8, ls=":", zorder=1)
        axes.plot([], [], color="black", lw=0.8, ls=":", label="paper's average (Table II)")
        axes.set_xlabel("vehicles per km and lane")
        axes.set_ylabel("packet reception rate [%]")
        axes.set_ylim(-2.0, 102.0)
        axes.set_xticks(sorted({round(point["vehicles_per_km"], 1) for point in points}))
        figure.legend(loc="outside right upper")
        write(figure, path)


def _draw_method(axes: Axes, points: list[dict[str, Any]], look: Look, shift: float) -> None:
    known = [point for point in points if point["prr"] is not None]
    x = [point["vehicles_per_km"] + shift for point in known]
    y = [100 * point["prr"] for point in known]
    below = [100 * (p["prr"] - p["prr_low"]) if p["prr_low"] is not None else 0.0 for p in known]
    above = [100 * (p["prr_high"] - p["prr"]) if p["prr_high"] is not None else 0.0 for p in known]
    axes.errorbar(
        x,
        y,
        yerr=[below, above],
        color=look.colour,
        marker=look.marker,
        markersize=5.0,
        linewidth=1.3,
        elinewidth=1.0,
        capsize=2.5,
        label=look.name,
        zorder=3,
    )
