"""The figure of what a decision needs: collisions over the share of scans that was there."""

from collections.abc import Sequence
from pathlib import Path
from typing import Final

from matplotlib.figure import Figure

from orchestrator.drawing import styled, write
from orchestrator.palette import COLOURS
from studies.collision.conditions import policy_name
from studies.lasting.decisions import Dose
from studies.method.style import bars

_MARKERS: Final = "os^vDPX*"

_DODGE: Final = 1.0
"""The distance between experiments at the same share [points]."""


def draw_doses(rows: Sequence[Dose], path: Path) -> None:
    """Draw collision rates over shares of scans, a line per experiment and policy.

    Args:
        rows: the table of them.
        path: the file to write, without suffix.
    """
    groups: dict[str, list[Dose]] = {}
    for row in rows:
        if row.collisions is not None:
            groups.setdefault(_name(row), []).append(row)
    with styled():
        figure = Figure(figsize=(8.0, 4.0), layout="constrained")
        axes = figure.subplots()
        for k, (name, own) in enumerate(groups.items()):
            rates = [row.collisions for row in own if row.collisions is not None]
            axes.errorbar(
                [
                    50 * (row.low + min(row.high, 1.0)) + _DODGE * (k - len(groups) / 2)
                    for row in own
                ],
                [100 * rate.value for rate in rates],
                yerr=bars(rates),
                color=COLOURS[k % len(COLOURS)],
                marker=_MARKERS[k % len(_MARKERS)],
                markersize=5.0,
                lw=0.8,
                capsize=2.5,
                label=name,
            )
        axes.set_xlabel(
            "scans of the last second before the point of no return that were there [%]"
        )
        axes.set_ylabel("collision rate [%]")
        axes.set_ylim(-3.0, 103.0)
        axes.set_xlim(-6.0, 106.0)
        figure.legend(loc="outside right upper", fontsize=8)
        write(figure, path)


def _name(row: Dose) -> str:
    what = row.experiment.removeprefix("lasting_").replace("_", ", ")
    return f"{what}: {policy_name(row.policy, row.compression)}"
