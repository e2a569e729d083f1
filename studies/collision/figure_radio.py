"""The figure of weaker radios."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from studies.method.style import looks, styled, write

Rows = Sequence[Mapping[str, Any]]


def draw(rows: Rows, constant: Rows, path: Path) -> None:
    """Draw to `path`, without suffix: collision rate over power, and over packet error rate.

    Args:
        rows: of `rates.rows`, those of radios.
        constant: those over constant packet error rates; the ones of the same compression and speed
            are drawn.
        path: without suffix.
    """
    like = {(row["compression"], row["speed_kmh"]) for row in rows}
    alike = [row for row in constant if (row["compression"], row["speed_kmh"]) in like]
    with styled():
        figure = Figure(figsize=(8.0, 3.6), layout="constrained")
        left, right = figure.subplots(1, 2, sharey=True)
        for relay, look in looks(list(dict.fromkeys(row["relay"] for row in rows))).items():
            own = [row for row in rows if row["relay"] == relay]
            style = {"color": look.colour, "marker": look.marker, "label": look.name}
            _draw(left, own, "transmit_power", 1.0, {**style, "ls": "-"})
            _draw(right, own, "per", 100.0, {**style, "ls": ""})
        style = {"color": "#666666", "marker": ".", "label": "constant PER", "ls": "-"}
        _draw(right, alike, "per", 100.0, style)
        left.set_xlabel("transmit power [dBm]")
        right.set_xlabel("packet error rate of what was sent [%]")
        left.set_ylabel("collision rate [%]")
        left.set_ylim(-3.0, 103.0)
        right.set_xlim(-3.0, 103.0)
        figure.legend(*right.get_legend_handles_labels(), loc="outside upper right", ncols=4)
        write(figure, path)


def _draw(axes: Axes, rows: Rows, x: str, scale: float, style: Mapping[str, Any]) -> None:
    known = sorted((r for r in rows if None not in (r[x], r["rate"])), key=lambda row: row[x])
    axes.errorbar(
        [scale * row[x] for row in known],
        [100 * row["rate"] for row in known],
        yerr=[
            [100 * max(0.0, row["rate"] - row["low"]) for row in known],
            [100 * max(0.0, row["high"] - row["rate"]) for row in known],
        ],
        lw=1.2,
        markersize=5.0,
        capsize=2.5,
        **style,
    )
