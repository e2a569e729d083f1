"""The figures of the campaign: Figures 9 and 10, driving policies, weaker radios, loads."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Final

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.markers import CARETDOWN

from orchestrator.drawing import WIDTH, legend_of, styled, write
from orchestrator.intervals import Estimate
from orchestrator.palette import BLACK, BLUE, DARK, VERMILLION
from studies.collision.claims import (
    COMPRESSION_32_RATE,
    COOPERNAUT,
    MOHED_PER,
    MOHED_RATE,
    Published,
)
from studies.collision.conditions import (
    CONSTANT,
    USUAL_AGE,
    load_name,
    policy_key,
    policy_name,
)
from studies.collision.statistics import Result
from studies.method.style import Look, bars, looks

_COLOURS: Final = {16: BLUE, 32: VERMILLION}
"""The colour of every compression."""

_FILLS: Final = {16: "white"}
"""What marks of a compression are filled with, if not with its colour."""

_OTHER: Final = DARK
_OURS: Final = BLUE
_THEIRS: Final = VERMILLION

_DODGE: Final = 0.8
"""The distance between compressions at the same packet error rate [points], so that no bar hides
another."""

_ONE: Final = "paper: 1 %"

_RANGES: Final = ((-3.0, 103.0), (-0.3, 10.3))
"""The ranges of the collision rate [%]: all, and those that a good method is about."""

_SHARES: Final = (-3.0, 103.0)
"""The range of shares [%]."""

Rows = Sequence[Result]

Quantity = Callable[[Result], Estimate | None]
"""What is drawn of a row."""

Known = list[tuple[Estimate, Estimate]]
"""A quantity and the collision rate, of every row that has both."""

Theirs = Callable[[Published], tuple[float, float]]
"""A number of a row of COOPERNAUT's table and its ± [%]."""


def draw_over_per(rows: Rows, path: Path) -> None:
    """Draw Figures 9 and 10: a column per speed, all rates above, small ones below.

    Args:
        rows: the table of the points on curves, at least one.
        path: the file to write, without suffix.
    """
    speeds = sorted({row.speed_kmh for row in rows}, reverse=True)
    relays = list(dict.fromkeys(r.relay for r in rows if r.channel != CONSTANT))
    with styled():
        figure = Figure(figsize=(WIDTH, 6.8), layout="constrained")
        panels = figure.subplots(
            len(_RANGES), len(speeds), sharex=True, sharey="row", squeeze=False,
            height_ratios=(3, 2),
        )  # fmt: skip
        for row, limits in zip(panels, _RANGES, strict=True):
            for axes, speed in zip(row, speeds, strict=True):
                _draw_speed(axes, [row for row in rows if row.speed_kmh == speed], relays)
                _draw_published(axes)
                axes.set_ylim(*limits)
            row[0].set_ylabel("collision rate [%]")
        for axes, speed in zip(panels[0], speeds, strict=True):
            axes.set_title(f"ego at {speed:g} km/h, {_runs(rows, speed)}")
        for axes in panels[-1]:
            axes.axhline(100 * MOHED_RATE, color=BLACK, lw=0.8, ls=":", zorder=1, label=_ONE)
            axes.set_xlabel("packet error rate, end to end [%]")
            axes.set_xlim(*_SHARES)
        legend_of(figure, panels[-1], loc="outside lower left", ncols=2)
        write(figure, path)


def _runs(rows: Rows, speed: float) -> str:
    counts = [row.runs for row in rows if row.speed_kmh == speed]
    least, most = min(counts), max(counts)
    return f"{most} runs each" if least == most else f"{least} to {most} runs each"


def _draw_speed(axes: Axes, rows: Rows, relays: list[str]) -> None:
    compressions = sorted({r.compression for r in rows if r.compression is not None})
    for k, compression in enumerate(compressions):
        shift = (k - (len(compressions) - 1) / 2) * _DODGE
        colour = _COLOURS.get(compression, _OTHER)
        own = [row for row in rows if row.compression == compression]
        ages = {row.maximum_age for row in own if row.maximum_age is not None}
        for age in sorted(ages, reverse=True):
            curve = [r for r in own if r.channel == CONSTANT and r.maximum_age == age]
            label = f"constant PER, compression {compression}"
            if age == USUAL_AGE:
                line = "-" if compression not in _FILLS else "-."
                _draw_constant(axes, curve, compression, line=line, label=label)
            else:
                label = f"{label}, scans of the last {age:g} s"
                _draw_constant(axes, curve, compression, line="--", label=label)
        for relay, look in looks(relays).items():
            points = [r for r in own if r.channel != CONSTANT and r.relay == relay]
            name = f"{look.name}, compression {compression}"
            fill = _FILLS.get(compression, colour)
            _draw_points(axes, points, shift, Look(name, colour, look.marker), fill)


def _draw_constant(axes: Axes, rows: Rows, compression: int, *, line: str, label: str) -> None:
    colour = _COLOURS.get(compression, _OTHER)
    known = sorted(_known(rows, _per), key=lambda each: each[0].value)
    if not known:
        return
    x = [100 * per.value for per, _ in known]
    low = [100 * (rate.value if rate.low is None else rate.low) for _, rate in known]
    high = [100 * (rate.value if rate.high is None else rate.high) for _, rate in known]
    axes.fill_between(x, low, high, color=colour, alpha=0.15, lw=0)
    rates = [100 * rate.value for _, rate in known]
    axes.plot(
        x, rates, color=colour, lw=1.2, ls=line, marker=".", markersize=4.0, label=label, zorder=2
    )


def _draw_points(axes: Axes, rows: Rows, shift: float, look: Look, fill: str) -> None:
    known = _known(rows, _per)
    if not known:
        return
    axes.errorbar(
        [100 * per.value + shift for per, _ in known],
        [100 * rate.value for _, rate in known],
        xerr=bars([per for per, _ in known]),
        yerr=bars([rate for _, rate in known]),
        color=look.colour,
        marker=look.marker,
        markersize=6.0,
        markerfacecolor=fill,
        linestyle="",
        elinewidth=1.0,
        capsize=2.5,
        label=look.name,
        zorder=3,
    )


def _draw_published(axes: Axes) -> None:
    """The two points that the paper names in its text."""
    points = (
        (MOHED_PER, MOHED_RATE, CARETDOWN, "paper: MoHeD, less than 1 %"),
        (0.0, COMPRESSION_32_RATE, "s", "paper: compression 32, no losses"),
    )
    for per, rate, marker, label in points:
        axes.plot(
            [100 * per],
            [100 * rate],
            marker=marker,
            label=label,
            color=BLACK,
            linestyle="",
            fillstyle="none",
            zorder=4,
        )


def draw_policies(rows: Rows, path: Path) -> None:
    """Draw driving policies under perfect communication, beside COOPERNAUT's.

    Args:
        rows: those of the policies.
        path: the file to write, without suffix.
    """
    panels: Sequence[tuple[str, Quantity, Theirs]] = (
        ("success rate [%]", lambda r: r.success, lambda p: (p.success, p.success_sd)),
        (
            "success weighted by\ncompletion time [%]",
            lambda r: r.sct,
            lambda p: (p.sct, p.sct_sd),
        ),
        ("collision rate [%]", _rate, lambda p: (p.collisions, p.collisions_sd)),
    )
    with styled():
        figure = Figure(figsize=(WIDTH, 1.3 + 0.34 * len(rows)), layout="constrained")
        all_axes = figure.subplots(1, len(panels), sharey=True)
        for axes, (title, ours, theirs) in zip(all_axes, panels, strict=True):
            _draw_ours(axes, rows, ours)
            _draw_theirs(axes, rows, theirs)
            axes.set_xlabel(title)
            axes.set_xlim(*_SHARES)
            axes.set_xticks([0, 50, 100])
        names = [policy_name(row.policy, row.compression) for row in rows]
        all_axes[0].set_yticks(range(len(rows)), names)
        all_axes[0].set_ylim(len(rows) - 0.4, -0.6)
        all_axes[0].set_ylabel("driving policy")
        handles, labels = all_axes[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper right", ncols=2)
        write(figure, path)


def _draw_ours(axes: Axes, rows: Rows, quantity: Quantity) -> None:
    _draw_across(
        axes,
        [(k - 0.1, quantity(row)) for k, row in enumerate(rows)],
        Look("here, with intervals of 95 %", _OURS, "o"),
    )


def _draw_theirs(axes: Axes, rows: Rows, theirs: Theirs) -> None:
    found = [COOPERNAUT.get(policy_key(row.policy, row.compression)) for row in rows]
    known = [(k, *theirs(one)) for k, one in enumerate(found) if one is not None]
    axes.errorbar(
        [value for _, value, _ in known],
        [k + 0.18 for k, _, _ in known],
        xerr=[deviation for *_, deviation in known],
        color=_THEIRS,
        marker="D",
        markersize=4.0,
        linestyle="",
        capsize=2.5,
        label="COOPERNAUT's table, with its ±",
    )


def draw_radio(rows: Rows, constant: Rows, path: Path) -> None:
    """Draw weaker radios: collision rate over power, and over packet error rate.

    Args:
        rows: those of radios.
        constant: those over constant packet error rates; the ones of the same compression and speed
            are drawn.
        path: the file to write, without suffix.
    """
    like = {(row.compression, row.speed_kmh) for row in rows}
    alike = [row for row in constant if (row.compression, row.speed_kmh) in like]
    with styled():
        figure = Figure(figsize=(WIDTH, 3.6), layout="constrained")
        left, right = figure.subplots(1, 2, sharey=True)
        for relay, look in looks(list(dict.fromkeys(row.relay for row in rows))).items():
            own = [row for row in rows if row.relay == relay]
            _draw_rates(left, _known(own, _power), 1.0, look, line="-")
            _draw_rates(right, _known(own, _per), 100.0, look, line="")
        look = Look("constant PER", _OTHER, ".")
        _draw_rates(right, _known(alike, _per), 100.0, look, line="-")
        left.set_xticks(sorted({r.transmit_power for r in rows if r.transmit_power is not None}))
        left.set_xlabel("transmit power [dBm]")
        right.set_xlabel("packet error rate of what was sent [%]")
        left.set_ylabel("collision rate [%]")
        left.set_ylim(*_SHARES)
        right.set_xlim(*_SHARES)
        figure.legend(*right.get_legend_handles_labels(), loc="outside upper right", ncols=4)
        write(figure, path)


def _draw_rates(axes: Axes, known: Known, scale: float, look: Look, *, line: str) -> None:
    known = sorted(known, key=lambda each: each[0].value)
    axes.errorbar(
        [scale * x.value for x, _ in known],
        [100 * rate.value for _, rate in known],
        yerr=bars([rate for _, rate in known]),
        lw=1.2,
        markersize=5.0,
        capsize=2.5,
        color=look.colour,
        marker=look.marker,
        label=look.name,
        ls=line,
    )


def draw_load(rows: Rows, path: Path) -> None:
    """Draw collision and packet error rates under every load and loss granularity.

    Args:
        rows: those of loads.
        path: the file to write, without suffix.
    """
    cases = list(dict.fromkeys(load_name(row.load, row.granularity) for row in rows))
    relays = list(dict.fromkeys(row.relay for row in rows))
    panels = ((_per, "packet error rate [%]"), (_rate, "collision rate [%]"))
    with styled():
        figure = Figure(figsize=(WIDTH, 1.2 + 0.45 * len(cases)), layout="constrained")
        both = figure.subplots(1, 2, sharey=True)
        for axes, (quantity, title) in zip(both, panels, strict=True):
            for k, (relay, look) in enumerate(looks(relays).items()):
                own = [row for row in rows if row.relay == relay]
                places = [cases.index(load_name(r.load, r.granularity)) for r in own]
                found = [
                    (place + 0.16 * k - 0.08, quantity(row))
                    for place, row in zip(places, own, strict=True)
                ]
                _draw_across(axes, found, look)
            axes.set_xlabel(title)
            axes.set_xlim(*_SHARES)
        both[0].set_yticks(range(len(cases)), cases)
        both[0].set_ylim(len(cases) - 0.5, -0.5)
        both[0].set_ylabel("load of the channel,\nwhat is lost at once")
        figure.legend(*both[0].get_legend_handles_labels(), loc="outside upper right", ncols=4)
        write(figure, path)


def _draw_across(axes: Axes, found: Sequence[tuple[float, Estimate | None]], look: Look) -> None:
    """Shares with their intervals, each at its height; those without an interval are left out."""
    known = [(y, one) for y, one in found if one is not None and None not in (one.low, one.high)]
    axes.errorbar(
        [100 * one.value for _, one in known],
        [y for y, _ in known],
        xerr=bars([one for _, one in known]),
        color=look.colour,
        marker=look.marker,
        markersize=5.0,
        linestyle="",
        capsize=2.5,
        label=look.name,
    )


def _known(rows: Rows, quantity: Quantity) -> Known:
    """A quantity and the collision rate of the rows that have both."""
    each = ((quantity(row), row.collision_rate) for row in rows)
    return [(x, rate) for x, rate in each if x is not None and rate is not None]


def _per(row: Result) -> Estimate | None:
    return row.packet_error_rate


def _rate(row: Result) -> Estimate | None:
    return row.collision_rate


def _power(row: Result) -> Estimate | None:
    power = row.transmit_power
    return None if power is None else Estimate(power, None, None)
