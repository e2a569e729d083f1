"""Pictures of the study: how good the choice is, and bytes against when the ego vehicle knows."""

from collections.abc import Sequence
from pathlib import Path
from typing import Final

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter, StrMethodFormatter

from orchestrator.drawing import SMALL, WIDTH, styled, write
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


_BELOW: Final = ("always-on",)
"""Ways of sharing whose labels are below their marks, where others have theirs above."""


def method_name(method: str) -> str:
    """What readers call a way of sharing."""
    return METHODS[method].name if method in METHODS else method


def draw_choice(found: Sequence[Score], path: Path) -> None:
    """Draw the regret over the share of lidars, a panel per scene, to `path` without suffix."""
    scenes = list(dict.fromkeys(one.scene for one in found))
    with styled():
        figure = Figure(figsize=(WIDTH, 3.4), layout="constrained")
        panels = figure.subplots(1, len(scenes), sharey=True, squeeze=False)[0]
        for axes, scene in zip(panels, scenes, strict=True):
            own = [one for one in found if one.scene == scene]
            apmm = [one for one in own if one.parameters == APMM.name]
            _curve(axes, apmm, [one.regret for one in apmm], METHODS["apmm"], -1.2)
            plain = [one for one in own if one.parameters == PLAIN.name]
            _curve(axes, plain, [one.regret for one in plain], METHODS["apmm-paper"], -0.4)
            nearest = Look("the nearest", ORANGE, "v")
            _curve(axes, apmm, [one.regret_nearest for one in apmm], nearest, 0.4)
            random = Look("a random one", GREY, "x")
            _curve(axes, apmm, [one.regret_random for one in apmm], random, 1.2)
            axes.set_title(f"{scene.replace('_', ' ')}, {_seeds(own)}")
            axes.set_xticks(sorted({round(100 * one.share, 6) for one in own}))
            axes.set_xlabel("vehicles with lidars [%]")
            axes.set_ylim(-2.0, 102.0)
        panels[0].set_ylabel("regret [%], with intervals of 95 %")
        figure.legend(
            *panels[-1].get_legend_handles_labels(), loc="outside upper center", ncols=4,
        )  # fmt: skip
        write(figure, path, (".svg",))


def _seeds(scores: Sequence[Score]) -> str:
    counts = sorted({one.seeds for one in scores})
    return " to ".join(str(n) for n in dict.fromkeys((counts[0], counts[-1]))) + " seeds"


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
        figure = Figure(figsize=(WIDTH, 3.8), layout="constrained")
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
            side, va = (5, "bottom") if method not in _BELOW else (-5, "top")
            for x, y, label in own:
                axes.annotate(
                    label, (x, y), (0, side), textcoords="offset points", fontsize=SMALL,
                    color=look.colour, ha="center", va=va,
                )  # fmt: skip
        axes.set_xscale("log")
        axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axes.xaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
        axes.xaxis.set_minor_formatter(NullFormatter())
        axes.set_xlabel("matrices, requests, sensor data, CPMs on the air [kB/s]")
        axes.set_ylabel("told of the hidden car at [s]")
        axes.margins(y=0.12)
        if axes.lines:
            axes.legend(title="in % : vehicles with lidars")
        write(figure, path, (".svg",))
