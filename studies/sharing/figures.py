"""Pictures of the study: how good the choice is, and bytes against when the ego vehicle knows."""

from collections.abc import Sequence
from pathlib import Path
from typing import Final

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from orchestrator.drawing import styled, write
from orchestrator.intervals import Estimate
from orchestrator.palette import BLUE, GREEN, GREY, ORANGE, PURPLE, VERMILLION
from studies.method.style import Look, bars
from studies.sharing.moments import APMM, PLAIN, Score
from studies.sharing.results import Result

METHODS: Final = {
    "apmm": Look("APMM, seen area", BLUE, "o"),
    "apmm-paper": Look("APMM, as in the paper", PURPLE, "s"),
    "always-on": Look("always-on", VERMILLION, "^"),
    "cpm": Look("CPM", GREEN, "D"),
    "none": Look("no sharing", GREY, "x"),
}
"""How ways of sharing look, and what readers call them."""


def method_name(method: str) -> str:
    """What readers call a way of sharing."""
    return METHODS[method].name if method in METHODS else method


def draw_choice(found: Sequence[Score], path: Path) -> None:
    """Draw the regret over the share of lidars, a panel per scene, to `path` without suffix."""
    scenes = list(dict.fromkeys(one.scene for one in found))
    with styled():
        figure = Figure(figsize=(3.6 * len(scenes), 3.2), layout="constrained")
        panels = figure.subplots(1, len(scenes), sharey=True, squeeze=False)[0]
        for axes, scene in zip(panels, scenes, strict=True):
            own = [one for one in found if one.scene == scene]
            apmm = [one for one in own if one.parameters == APMM.name]
            _curve(axes, apmm, [one.regret for one in apmm], METHODS["apmm"], -0.4)
            plain = [one for one in own if one.parameters == PLAIN.name]
            _curve(axes, plain, [one.regret for one in plain], METHODS["apmm-paper"], -0.15)
            nearest = Look("the nearest", ORANGE, "v")
            _curve(axes, apmm, [one.regret_nearest for one in apmm], nearest, 0.15)
            random = Look("a random one", GREY, "x")
            _curve(axes, apmm, [one.regret_random for one in apmm], random, 0.4)
            axes.set_title(scene.replace("_", " "))
            axes.set_xlabel("vehicles with lidars [%]")
            axes.set_ylim(-2.0, 102.0)
        panels[0].set_ylabel("regret [%]")
        panels[-1].legend(fontsize="small")
        write(figure, path, (".svg",))


def _curve(
    axes: Axes, scores: Sequence[Score], values: Sequence[Estimate | None], look: Look, shift: float
) -> None:
    known = [(100 * s.share + shift, v) for s, v in zip(scores, values, strict=True) if v]
    axes.errorbar(
        [x for x, _ in known],
        [100 * value.value for _, value in known],
        yerr=bars([value for _, value in known]),
        color=look.colour,
        marker=look.marker,
        capsize=2.5,
        linewidth=1.2,
        label=look.name,
    )


def draw_bytes(found: Sequence[Result], path: Path) -> None:
    """Draw bytes against the time of first knowledge, to `path` without suffix."""
    with styled():
        figure = Figure(figsize=(5.4, 3.6), layout="constrained")
        axes = figure.add_subplot()
        for method, look in METHODS.items():
            own = [
                (row.sharing_kbyte_s.value, row.told_s.value, row.lidars or "")
                for row in found
                if row.method == method and row.sharing_kbyte_s and row.told_s
            ]
            if not own:
                continue
            axes.plot(
                [x for x, _, _ in own],
                [y for _, y, _ in own],
                color=look.colour,
                marker=look.marker,
                linewidth=0.8,
                label=look.name,
            )
            for x, y, label in own:
                axes.annotate(
                    label, (x, y), (3, 4), textcoords="offset points", fontsize=7, color=look.colour
                )
        axes.set_xscale("log")
        axes.set_xlabel("matrices, requests, sensor data, CPMs on the air [kB/s]")
        axes.set_ylabel("told of the hidden car at [s]")
        if axes.lines:
            axes.legend(fontsize="small")
        write(figure, path, (".svg",))
