"""The figure of loads and loss granularities."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from studies.method.style import looks, styled, write


def draw(rows: Sequence[Mapping[str, Any]], path: Path) -> None:
    """Draw to `path`, without suffix: collision and packet error rates under every load.

    Args:
        rows: of `rates.rows`, those of loads.
        path: without suffix.
    """
    cases = list(dict.fromkeys((row["load"], row["granularity"]) for row in rows))
    relays = list(dict.fromkeys(row["relay"] for row in rows))
    panels = (
        ("per", "per_low", "per_high", "packet error rate [%]"),
        ("rate", "low", "high", "collision rate [%]"),
    )
    with styled():
        figure = Figure(figsize=(8.0, 1.2 + 0.45 * len(cases)), layout="constrained")
        both = figure.subplots(1, 2, sharey=True)
        for axes, (name, low, high, title) in zip(both, panels, strict=True):
            for k, (relay, look) in enumerate(looks(relays).items()):
                own = [r for r in rows if r["relay"] == relay]
                known = [r for r in own if None not in (r[name], r[low], r[high])]
                axes.errorbar(
                    [100 * r[name] for r in known],
                    [cases.index((r["load"], r["granularity"])) + 0.16 * k - 0.08 for r in known],
                    xerr=[
                        [100 * max(0.0, r[name] - r[low]) for r in known],
                        [100 * max(0.0, r[high] - r[name]) for r in known],
                    ],
                    color=look.colour,
                    marker=look.marker,
                    markersize=5.0,
                    linestyle="",
                    capsize=2.5,
                    label=look.name,
                )
            axes.set_xlabel(title)
            axes.set_xlim(-3.0, 103.0)
        both[0].set_yticks(range(len(cases)), [", ".join(filter(None, case)) for case in cases])
        both[0].set_ylim(len(cases) - 0.5, -0.5)
        figure.legend(*both[0].get_legend_handles_labels(), loc="outside upper right", ncols=4)
        write(figure, path)
