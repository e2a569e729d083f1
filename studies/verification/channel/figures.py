"""Figures of a verification: sizes of errors, reception over SNIR and distance, fading."""

import math
from collections.abc import Callable, Iterator, Sequence
from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, LogLocator, NullFormatter

from orchestrator.drawing import SMALL, WIDTH, legend_of
from orchestrator.intervals import wilson
from orchestrator.palette import (
    BLACK,
    BLUE,
    COLOURS,
    GREY,
    LINK_COLOURS,
    LINK_LINES,
)
from studies.verification.channel.link_budget import ANTENNA, PATH_LOSS
from studies.verification.channel.reception import MIN_SNIR
from studies.verification.channel.shadowing import BUILDINGS, KNIFE_EDGES, VEHICLES
from studies.verification.channel.shown import LEAST, Errors, Rate, Run, Shown, Values
from studies.verification.drawing import Drawing

_TITLES: Final = {
    PATH_LOSS: "path loss",
    BUILDINGS: "loss by buildings",
    VEHICLES: "loss by vehicles",
    KNIFE_EDGES: "loss by knife edges",
    ANTENNA: "antenna gain",
    MIN_SNIR: "lowest SNIR",
}
_MARKERS: Final = "o^sDvPX*"
_COLOURS: Final = (*COLOURS, GREY)
_COLUMNS: Final = 3
_TOP: Final = 1e-2
"""The largest error of the axes that show errors of single values."""


def drawings(shown: Shown) -> Iterator[Drawing]:
    """Draw everything that there are data for."""
    if shown.values:
        caption = (
            "Files of single values: how far ours is from golden, over the golden value, every "
            "case. Dashed: the largest error that passes. Those without any error are in the "
            "lowest row."
        )
        yield Drawing(name="values.png", caption=caption, figure=_values(shown.values))
    if shown.rates:
        caption = (
            "Probability that a packet is decoded, of the shortest (left of each pair) and of the "
            "longest packets: golden as marks, where it is neither 0 nor 1, ours as lines."
        )
        yield Drawing(name="error-rate.png", caption=caption, figure=_error_rates(shown.rates))
    if shown.errors:
        caption = (
            "How many values have an error of which size: bins of a quarter of a decade. Dashed: "
            "the largest error that passes. Values without an error are counted at the left end."
        )
        yield Drawing(name="errors.png", caption=caption, figure=_errors(shown.errors))
    if shown.fading:
        caption = (
            "Fading: differences of statistics in standard deviations of the difference, and "
            "the distribution that equal samples have (line). A quantile of 1 agrees exactly."
        )
        yield Drawing(name="fading.png", caption=caption, figure=_fading(shown.fading))
    for run in shown.runs:
        caption = (
            f"{run.name}: packet reception ratio (PRR) over the distance, with given transmit "
            "times. Golden with Wilson intervals of 95 %, ours as a line in its own interval; "
            "the events of a bin are not independent, so the intervals are too narrow."
        )
        yield Drawing(name=f"prr-{run.name}.png", caption=caption, figure=_prr(run))


def _grid(count: int, height: float) -> tuple[Figure, list[Axes]]:
    rows = math.ceil(count / _COLUMNS)
    figure = Figure(figsize=(WIDTH, height * rows + 0.3), layout="constrained")
    return figure, [figure.add_subplot(rows, _COLUMNS, k + 1) for k in range(count)]


def _values(files: Sequence[Values]) -> Figure:
    figure, panels = _grid(len(files), 2.7)
    for axes, one in zip(panels, files, strict=True):
        for k, kind in enumerate(one.kinds):
            label = kind.label if len(one.kinds) > 1 else None
            axes.plot(
                kind.golden, np.maximum(kind.error, LEAST), _MARKERS[k], ms=2.2, mew=0,
                color=COLOURS[k], alpha=0.7, label=label,
            )  # fmt: skip
        _tolerance(axes.axhline, one.tolerance)
        axes.set_yscale("log")
        axes.set_ylim(LEAST / 4, _TOP)
        _name_decades(axes.yaxis, -15, -3, 3)
        axes.set_title(_TITLES[one.name])
        axes.set_xlabel("golden [dB]")
        if len(one.kinds) > 1:
            axes.legend(
                loc="upper left", ncols=2, markerscale=2.0, handletextpad=0.0, columnspacing=0.5,
                borderaxespad=0.0,
            )  # fmt: skip
    figure.supylabel("error [dB]", fontsize=9.0)
    return figure


def _tolerance(draw: Callable[..., object], value: float) -> None:
    """Draw where errors stop to pass."""
    draw(value, color=BLACK, lw=1.0, ls="--")


def _name_decades(axis: Axis, first: int, last: int, step: int) -> None:
    """Label decades, and `none` where errors are drawn that are none."""
    places = [LEAST, *(10.0**k for k in range(first, last + 1, step))]
    names = ["none", *(f"$10^{{{k}}}$" for k in range(first, last + 1, step))]
    axis.set_major_locator(FixedLocator(places))
    axis.set_ticklabels(names)
    axis.set_minor_locator(LogLocator(numticks=30))
    axis.set_minor_formatter(NullFormatter())


def _error_rates(rates: Sequence[Rate]) -> Figure:
    figure = Figure(figsize=(WIDTH, 3.4), layout="constrained")
    axes = figure.add_subplot()
    between = []
    for k, rate in enumerate(rates):
        snir = np.array(rate.snir)
        for golden, ours in zip(rate.golden, rate.ours, strict=True):
            some = np.array(golden)
            inner = (some > 1e-3) & (some < 1 - 1e-3)
            between += snir[inner].tolist()
            axes.plot(snir, ours, color=_COLOURS[k], lw=0.8)
            axes.plot(
                snir[inner], some[inner], _MARKERS[k], ms=3.5, mew=0.6, color=_COLOURS[k],
                fillstyle="none",
            )  # fmt: skip
        axes.plot(
            [], [], color=_COLOURS[k], lw=0.8, marker=_MARKERS[k], fillstyle="none",
            label=rate.label,
        )  # fmt: skip
    if between:
        axes.set_xlim(min(between) - 2.0, max(between) + 2.0)
    axes.set_xlabel("SNIR [dB]; left of each pair: the shortest packets, right: the longest")
    axes.set_ylabel("share of packets decoded")
    figure.legend(loc="outside right upper", title="marks: golden\nlines: ours")
    return figure


def _errors(files: Sequence[Errors]) -> Figure:
    figure, panels = _grid(len(files), 1.75)
    for axes, one in zip(panels, files, strict=True):
        edges = 10.0 ** np.array(one.exponents)
        axes.bar(edges, one.counts, edges * (10**0.25 - 1), align="edge", color=BLUE)
        if one.zeros:
            axes.bar(
                LEAST, one.zeros, LEAST * (10**0.5 - 1), align="center", color="white",
                edgecolor=BLUE, hatch="////",
            )  # fmt: skip
        _tolerance(axes.axvline, one.tolerance)
        axes.set_xscale("log")
        axes.set_yscale("log")
        axes.set_xlim(LEAST / 4, _TOP)
        axes.set_ylim(0.7, 2.0 * max(*one.counts, one.zeros, 1))
        _name_decades(axes.xaxis, -14, -2, 4)
        axes.set_title(one.name)
        axes.set_xlabel("error" if one.unit == "1" else f"error [{one.unit}]", fontsize=SMALL)
        axes.tick_params(labelsize=SMALL)
    figure.supylabel("values", fontsize=9.0)
    return figure


def _fading(sigma: Sequence[float]) -> Figure:
    figure = Figure(figsize=(WIDTH, 2.6), layout="constrained")
    axes = figure.add_subplot()
    known = np.array(sigma)
    bins = np.linspace(0, max(5.0, float(known[np.isfinite(known)].max(initial=0))), 41)
    axes.hist(
        known, bins=bins.tolist(), color=BLUE, alpha=0.6, label=f"{len(known)} statistics"
    )  # fmt: skip
    x = np.linspace(0, bins[-1], 200)
    density = np.sqrt(2 / np.pi) * np.exp(-(x**2) / 2)
    expected = density * len(known) * (bins[1] - bins[0])
    axes.plot(x, expected, color=BLACK, lw=1.2, label="expected of equal samples")
    axes.set_xlabel("difference [standard deviations of it]")
    axes.set_ylabel("statistics")
    axes.legend(loc="upper right")
    return figure


def _prr(run: Run) -> Figure:
    figure = Figure(figsize=(WIDTH, 2.7), layout="constrained")
    panels = figure.subplots(1, len(run.ratios), sharey=True, squeeze=False)[0]
    for axes, one in zip(panels, run.ratios, strict=True):
        colour, line = LINK_COLOURS[one.link], LINK_LINES[one.link]
        events, ours, golden = (np.array(n) for n in (one.events, one.ours, one.golden))
        low, high = wilson(ours, events)
        axes.fill_between(one.distance, low, high, color=colour, alpha=0.3, lw=0)
        axes.plot(one.distance, ours / events, color=colour, ls=line, label=f"ours, {one.link}")
        share = golden / events
        low, high = wilson(golden, events)
        bars = np.maximum([share - low, high - share], 0)
        axes.errorbar(
            one.distance, share, bars, fmt=".", color=BLACK, ms=4, lw=1, label="golden (Veins)"
        )
        axes.set_title(f"{one.link}, {events.sum()} frames")
        axes.set_xlabel("distance [m]")
        axes.set_xlim(left=0.0)
    panels[0].set_ylim(-0.03, 1.03)
    panels[0].set_ylabel("PRR")
    legend_of(figure, panels, loc="outside upper right", ncols=len(panels) + 1)
    return figure
