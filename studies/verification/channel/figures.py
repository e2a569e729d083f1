"""Figures of a verification: ours against golden, errors, reception over the distance."""

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from orchestrator.intervals import wilson
from orchestrator.palette import BLUE, COLOURS, GREY, LINK_COLOURS, VERMILLION
from orchestrator.signal import Array
from studies.verification.channel.comparison import Comparison, ReceptionRatio
from studies.verification.channel.fading import FADING_STATISTICS
from studies.verification.channel.link_budget import ANTENNA, PATH_LOSS
from studies.verification.channel.reception import ERROR_RATE, MIN_SNIR
from studies.verification.channel.shadowing import BUILDINGS, KNIFE_EDGES, VEHICLES
from studies.verification.drawing import Drawing

_LEGEND: Final = 5  # entries that fit
_TITLES: Final = {
    PATH_LOSS: "path loss [dB]",
    BUILDINGS: "buildings [dB]",
    VEHICLES: "vehicles [dB]",
    KNIFE_EDGES: "knife edges [dB]",
    ANTENNA: "antenna gain [dB]",
    MIN_SNIR: "lowest SNIR [dB]",
}


def drawings(files: Mapping[str, Comparison]) -> Iterator[Drawing]:
    """Draw everything that `files` has data for."""
    files = {name: comparison for name, comparison in files.items() if comparison.series}
    values = {name: files[name] for name in _TITLES if name in files}
    if values:
        caption = "Ours over golden, every case of the files of single values."
        yield Drawing(name="values.png", caption=caption, figure=_values(values))
    if ERROR_RATE in files:
        caption = "Probability that a packet is decoded: golden as dots, ours as lines."
        yield Drawing(
            name="error-rate.png", caption=caption, figure=_error_rates(files[ERROR_RATE])
        )
    errors = {name: one for name, one in files.items() if one.unit != "sigma"}
    if errors:
        caption = "Errors, and tolerances in red. Errors of 0 are drawn at the left end."
        yield Drawing(name="errors.png", caption=caption, figure=_errors(errors))
    if FADING_STATISTICS in files:
        caption = (
            "Fading: differences of statistics in standard deviations of the difference, and "
            "the distribution that equal samples have (line)."
        )
        yield Drawing(name="fading.png", caption=caption, figure=_fading(files[FADING_STATISTICS]))
    for name, comparison in files.items():
        ratios = comparison.stack.ratios if comparison.stack else ()
        if len(ratios) > 1:
            run = name.removeprefix("stack/")
            caption = (
                f"{run}: packet reception ratio (PRR) over the distance, with given transmit "
                "times. Golden with Wilson intervals of 95 %, ours as a line in its own interval; "
                "the events of a bin are not independent, so the intervals are too narrow."
            )
            yield Drawing(name=f"prr-{run}.png", caption=caption, figure=_prr(ratios))


def _grid(count: int, columns: int, height: float) -> tuple[Figure, list[Axes]]:
    rows = math.ceil(count / columns)
    figure = Figure(figsize=(11, height * rows), layout="constrained")
    return figure, [figure.add_subplot(rows, columns, k + 1) for k in range(count)]


def _values(files: Mapping[str, Comparison]) -> Figure:
    figure, panels = _grid(len(files), 3, 3.2)
    for axes, (name, comparison) in zip(panels, files.items(), strict=True):
        for colour, one in zip(COLOURS * 3, comparison.series, strict=False):
            axes.plot(one.golden, one.ours, ".", ms=2, color=colour, label=one.label)
        axes.axline((0, 0), slope=1, color="black", lw=0.5)
        axes.set_title(_TITLES[name], fontsize=10)
        axes.set_xlabel("golden")
        axes.set_ylabel("ours")
        if len(comparison.series) <= _LEGEND:
            axes.legend(fontsize=7, markerscale=4)
    return figure


def _error_rates(comparison: Comparison) -> Figure:
    figure = Figure(figsize=(11, 3.6), layout="constrained")
    axes = figure.add_subplot()
    packets = [one for one in comparison.series if "packet" in one.label]
    for colour, one in zip((*COLOURS, GREY), packets, strict=False):
        order = np.argsort(one.x, kind="stable")
        axes.plot(one.x[order], one.golden[order], ".", ms=2.5, color=colour)
        low, high = (_extremes(one.x, one.ours, pick) for pick in (np.minimum, np.maximum))
        axes.fill_between(low[0], low[1], high[1], color=colour, alpha=0.3, lw=0)
        axes.plot(*low, color=colour, lw=0.7, label=one.label.split(",")[0])
        axes.plot(*high, color=colour, lw=0.7)
    axes.set_xlabel("SNIR [dB]; the lines are the shortest and the longest packets")
    axes.set_ylabel("success")
    axes.legend(fontsize=8, loc="lower right")
    return figure


def _extremes(x: Array, y: Array, pick: np.ufunc) -> tuple[Array, Array]:
    """Find the smallest or largest y of each x."""
    places, index = np.unique(x, return_inverse=True)
    start = 2.0 if pick is np.minimum else -1.0
    found = np.full(len(places), start)
    pick.at(found, index, y)
    return places, found


def _errors(files: Mapping[str, Comparison]) -> Figure:
    figure, panels = _grid(len(files), 4, 2.3)
    for axes, (name, comparison) in zip(panels, files.items(), strict=True):
        errors = [np.abs(one.ours - one.golden) for one in comparison.series]
        first = errors[:1] if name.startswith("stack/") else errors  # the received powers
        exponent = np.log10(np.maximum(np.concatenate(first), 1e-17))
        tolerance = math.log10(comparison.tolerance)
        top = max(tolerance + 1, float(exponent.max()) + 0.5)
        axes.hist(exponent, bins=np.linspace(-17, top, 60).tolist(), color=BLUE)
        axes.axvline(tolerance, color=VERMILLION, lw=1)
        axes.set_yscale("log")
        axes.set_title(name.removeprefix("stack/"), fontsize=9)
        unit = "" if comparison.unit == "1" else f" [{comparison.unit}]"
        axes.set_xlabel(f"log10 of the error{unit}", fontsize=8)
        axes.tick_params(labelsize=8)
        axes.xaxis.set_major_locator(MaxNLocator(integer=True, nbins=6))
    return figure


def _fading(comparison: Comparison) -> Figure:
    figure = Figure(figsize=(11, 2.6), layout="constrained")
    axes = figure.add_subplot()
    sigma = comparison.series[0].x
    bins = np.linspace(0, max(5.0, float(sigma[np.isfinite(sigma)].max(initial=0))), 41)
    axes.hist(sigma, bins=bins.tolist(), color=BLUE)
    x = np.linspace(0, bins[-1], 200)
    density = np.sqrt(2 / np.pi) * np.exp(-(x**2) / 2)
    axes.plot(x, density * len(sigma) * (bins[1] - bins[0]), color="black", lw=1)
    axes.set_xlabel("difference [sigma]; a quantile of 1 agrees exactly")
    axes.set_ylabel("statistics")
    return figure


def _prr(ratios: Sequence[ReceptionRatio]) -> Figure:
    figure, panels = _grid(len(ratios), 3, 2.8)
    for axes, one in zip(panels, ratios, strict=True):
        colour = LINK_COLOURS[one.link]
        low, high = wilson(one.ours, one.events)
        axes.fill_between(one.distance, low, high, color=colour, alpha=0.3, lw=0)
        axes.plot(one.distance, one.ours / one.events, color=colour, label="ours")
        golden = one.golden / one.events
        low, high = wilson(one.golden, one.events)
        bars = np.maximum([golden - low, high - golden], 0)
        axes.errorbar(one.distance, golden, bars, fmt=".", color="black", ms=4, lw=1, label="Veins")
        axes.set_title(f"{one.link}, {int(one.events.sum())} events", fontsize=10)
        axes.set_xlabel("distance [m]")
        axes.set_ylabel("PRR")
        axes.set_ylim(-0.03, 1.03)
        axes.legend(fontsize=8)
    return figure
