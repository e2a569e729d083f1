"""The figure of what a decision needs: collisions over the scans that were there, and their age."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from orchestrator.drawing import WIDTH, legend_of, styled, write
from orchestrator.palette import COLOURS
from studies.collision.conditions import USUAL_AGE, policy_name
from studies.lasting.decisions import AGE, THERE, Dose, bounds
from studies.method.style import Look, bars

_MARKERS: Final = "os^vDPX*"

_SPREAD: Final = 0.5
"""The share of a bin's width over which the experiments are drawn side by side."""

_LABELS: Final = {
    THERE: "scans of the last second before the\npoint of no return that were there [%]",
    AGE: "age of the newest scan\nat the point of no return [s]",
}


def draw_doses(rows: Sequence[Dose], path: Path) -> None:
    """Draw collision rates over what was there: a row of panels per experiment.

    Args:
        rows: the table of them.
        path: the file to write, without suffix.
    """
    known = [row for row in rows if row.collisions is not None]
    experiments = list(dict.fromkeys(row.experiment for row in known))
    names = list(dict.fromkeys(_name(row) for row in known))
    looks = {
        name: Look(name, COLOURS[k % len(COLOURS)], _MARKERS[k % len(_MARKERS)])
        for k, name in enumerate(names)
    }
    with styled():
        figure = Figure(figsize=(WIDTH, 1.45 * len(experiments) + 1.5), layout="constrained")
        grid = figure.subplots(
            len(experiments), len(_LABELS), sharey=True, sharex="col", squeeze=False,
            width_ratios=(5, 7),
        )  # fmt: skip
        for panels, experiment in zip(grid, experiments, strict=True):
            own = [row for row in known if row.experiment == experiment]
            for axes, measure in zip(panels, _LABELS, strict=True):
                _draw(axes, [row for row in own if row.measure == measure], looks, measure)
            panels[0].set_title(_title(experiment, own), loc="left")
        for axes, measure in zip(grid[-1], _LABELS, strict=True):
            axes.set_xlabel(_LABELS[measure])
        figure.supylabel("collision rate [%], with intervals of 95 %", fontsize=9.0)
        grid[0, 0].set_ylim(-5.0, 105.0)
        legend_of(figure, grid.ravel(), loc="outside upper left", ncols=2)
        write(figure, path)


def _draw(axes: Axes, rows: Sequence[Dose], looks: Mapping[str, Look], measure: str) -> None:
    bins = bounds(measure)
    names = list(dict.fromkeys(_name(row) for row in rows))
    for k, name in enumerate(names):
        own = [row for row in rows if _name(row) == name]
        rates = [row.collisions for row in own if row.collisions is not None]
        shift = _SPREAD * ((k + 0.5) / len(names) - 0.5)
        axes.errorbar(
            [bins.index((row.low, row.high)) + shift for row in own],
            [100 * rate.value for rate in rates],
            yerr=bars(rates),
            color=looks[name].colour,
            marker=looks[name].marker,
            markersize=5.0,
            lw=0.8,
            capsize=2.5,
            label=name,
        )
    axes.set_xticks(range(len(bins)), [_bin(measure, *each) for each in bins])
    axes.set_xlim(-0.5, len(bins) - 0.5)


def _title(experiment: str, rows: Sequence[Dose]) -> str:
    """What is drawn in a row of panels, and of how many runs the points are."""
    counts = [row.runs for row in rows]
    what = experiment.removeprefix("lasting_").replace("_", ", ")
    each = " to ".join(str(n) for n in dict.fromkeys((min(counts), max(counts))))
    return f"{what}: {each} runs per point"


def _bin(measure: str, low: float, high: float) -> str:
    """What is counted together, as the axis has it."""
    if measure == AGE:
        return f"{low:g}\nto {high:g}" if high != float("inf") else f"{low:g}\nor more"
    if high < 0.01:
        return "none"
    return f"{0 if low < 0.01 else 100 * low:g}\nto {100 * min(high, 1.0):g}"


def _name(row: Dose) -> str:
    age = row.maximum_age
    uses = "" if age in (None, USUAL_AGE) else f", scans of the last {age:g} s"
    return policy_name(row.policy, row.compression) + uses
