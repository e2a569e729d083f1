"""The figure of driving policies under perfect communication, beside COOPERNAUT's."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from studies.collision.names import policy_key, policy_name
from studies.collision.published import COOPERNAUT
from studies.method.style import styled, write

_PANELS: Final = (
    ("success", "success_low", "success_high", "success rate [%]", "success"),
    ("sct", "sct_low", "sct_high", "success weighted by\ncompletion time [%]", "sct"),
    ("rate", "low", "high", "collision rate [%]", "collisions"),
)
"""Columns of the table, title, and what is published."""

_OURS: Final = "#0072B2"
_THEIRS: Final = "#D55E00"


def draw(rows: Sequence[Mapping[str, Any]], path: Path) -> None:
    """Draw to `path`, without suffix.

    Args:
        rows: of `rates.rows`, of the policies.
        path: without suffix.
    """
    with styled():
        figure = Figure(figsize=(9.0, 1.3 + 0.34 * len(rows)), layout="constrained")
        panels = figure.subplots(1, len(_PANELS), sharey=True)
        for axes, (name, low, high, title, published) in zip(panels, _PANELS, strict=True):
            _draw_panel(axes, rows, (name, low, high), published)
            axes.set_xlabel(title)
            axes.set_xlim(-3.0, 103.0)
        panels[0].set_yticks(range(len(rows)), [policy_name(row) for row in rows])
        panels[0].set_ylim(len(rows) - 0.4, -0.6)
        handles, labels = panels[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper right", ncols=2)
        write(figure, path)


def _draw_panel(
    axes: Axes, rows: Sequence[Mapping[str, Any]], columns: tuple[str, str, str], published: str
) -> None:
    known = [(k, [row[c] for c in columns]) for k, row in enumerate(rows)]
    known = [(k, values) for k, values in known if None not in values]
    axes.errorbar(
        [100 * value for _, (value, _, _) in known],
        [k - 0.1 for k, _ in known],
        xerr=[
            [100 * max(0.0, value - low) for _, (value, low, _) in known],
            [100 * max(0.0, high - value) for _, (value, _, high) in known],
        ],
        color=_OURS,
        marker="o",
        markersize=5.0,
        linestyle="",
        capsize=2.5,
        label="here, with intervals of 95 %",
    )
    theirs = [(k, COOPERNAUT.get(policy_key(row))) for k, row in enumerate(rows)]
    there = [(k, one) for k, one in theirs if one is not None]
    axes.errorbar(
        [getattr(one, published) for _, one in there],
        [k + 0.18 for k, _ in there],
        xerr=[getattr(one, f"{published}_sd") for _, one in there],
        color=_THEIRS,
        marker="D",
        markersize=4.0,
        linestyle="",
        capsize=2.5,
        label="COOPERNAUT's table, with its ±",
    )
