"""The figure of a training: losses over epochs, and how the drives went."""

from collections.abc import Sequence
from pathlib import Path
from typing import Final

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, MaxNLocator, NullFormatter, StrMethodFormatter

from orchestrator.drawing import SMALL, WIDTH, styled, write
from orchestrator.palette import BLACK, BLUE, DARK, GREEN, VERMILLION
from studies.training.results import OUTCOMES, Findings, Row

NAME: Final = "training"
"""The name of the files, without suffix."""

_COLOURS: Final = {
    "training": BLUE,
    "validation": VERMILLION,
    "collision": VERMILLION,
    "success": GREEN,
}
"""Colours of Okabe and Ito's palette, which readers with colour blindness can tell apart."""

_ROUNDS: Final = 8
"""So many names of rounds have room side by side."""

_MARKERS: Final = {"collision": "X", "success": "o"}
"""The mark of each, for readers without colours."""


def draw(found: Findings, directory: Path) -> None:
    """Write `training.svg` and `training.png`; equal findings make equal bytes."""
    with styled():
        figure = Figure(figsize=(WIDTH, 6.2), layout="constrained")
        above, below = figure.subplots(2, 1)
        _losses(above, found.epochs)
        _drives(below, found.phases)
        write(figure, directory / NAME)


def _losses(axes: Axes, epochs: Sequence[Row]) -> None:
    """Draw the losses over all epochs, one after the other.

    Marked are where a round begins and which epoch it kept.
    """
    counts = range(1, len(epochs) + 1)
    for which in ("training", "validation"):
        losses = [row[f"{which}_loss"] for row in epochs]
        line = "-" if which == "training" else "--"
        axes.plot(counts, losses, line, color=_COLOURS[which], label=which, linewidth=1.2)
    kept = [
        (k, row["validation_loss"]) for k, row in zip(counts, epochs, strict=True) if row["kept"]
    ]
    if kept:
        axes.plot(*zip(*kept, strict=True), "o", color=BLACK, markersize=4, label="kept")
    is_few = len({row["round"] for row in epochs}) <= _ROUNDS
    for k, row in zip(counts, epochs, strict=True):
        if row["epoch"] == 1:
            axes.axvline(k - 0.5, color=DARK, linewidth=0.8, linestyle=":")
            axes.annotate(
                f"round {row['round']}",
                xy=(k - 0.5, 1.0),
                xycoords=("data", "axes fraction"),
                xytext=(2, 2),
                textcoords="offset points",
                va="bottom",
                fontsize=SMALL,
                rotation=0 if is_few else 90,
            )
    if epochs and all(row[f"{w}_loss"] > 0 for row in epochs for w in ("training", "validation")):
        axes.set_yscale("log")
        axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 3.0, 5.0)))
        axes.yaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
        axes.yaxis.set_minor_formatter(NullFormatter())
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.set(xlabel="epoch", ylabel="mean loss")
    _legend(axes, 1.09 if is_few else 1.25)


def _drives(axes: Axes, phases: Sequence[Row]) -> None:
    """Shares of collisions and successes per phase, with intervals of 95 % (Wilson)."""
    for shift, name in zip((-0.08, 0.08), OUTCOMES, strict=True):
        known = [(k, row) for k, row in enumerate(phases) if row[name] is not None]
        if not known:
            continue
        places = [k + shift for k, _ in known]
        values = [row[name] for _, row in known]
        below = [max(row[name] - row[f"{name}_low"], 0.0) for _, row in known]
        above = [max(row[f"{name}_high"] - row[name], 0.0) for _, row in known]
        axes.errorbar(
            places,
            values,
            yerr=[below, above],
            fmt=_MARKERS[name],
            color=_COLOURS[name],
            label=name,
            markersize=4,
            capsize=2,
            linewidth=1.0,
        )
    labels = [f"{row['phase']}\n$\\beta$ = {row['beta']:.3g}" for row in phases]
    axes.set_xticks(
        range(len(phases)), labels, fontsize=SMALL, rotation=90 if len(phases) > 8 else 0
    )
    axes.set(
        ylim=(-0.03, 1.03),
        xlabel="phase of driving",
        ylabel="share of runs, with intervals of 95 %",
    )
    _legend(axes, 1.04)


def _legend(axes: Axes, height: float) -> None:
    """Put a legend above the axes, where no data are, at so much of their height."""
    handles, names = axes.get_legend_handles_labels()
    if handles:
        axes.legend(loc="lower right", bbox_to_anchor=(1.0, height), ncols=len(names))
