"""How all figures look and are written, and the page of panels that measures draw.

Whoever draws enters `styled`, takes colours from `orchestrator.palette`, and writes with `write`.
"""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.rcsetup import cycler

from orchestrator.measure import Panel
from orchestrator.palette import COLOURS

_SETTINGS: Final[Any] = {  # matplotlib's types list every name as a literal
    "font.family": "DejaVu Sans",  # comes with matplotlib: the same on every machine
    "font.size": 9.0,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.titlesize": 9.0,
    "axes.grid": True,
    "axes.prop_cycle": cycler(color=COLOURS),
    "grid.alpha": 0.25,
    "legend.frameon": False,
    "legend.fontsize": 8.0,
    "legend.title_fontsize": 8.0,
    "hatch.linewidth": 0.6,
    "svg.fonttype": "path",
    "svg.hashsalt": "nlosim",  # identifiers in the file do not vary
}
DPI: Final = 200
"""Pixels per inch of pictures in pixels."""

WIDTH: Final = 7.6
"""How wide a page of the manual shows a figure [inch]; of a wider one the texts shrink."""

TITLE: Final = 9.0
SMALL: Final = 8.0
"""Sizes of texts beside the usual one [points]: titles of panels, and what stands in a panel."""

_COLUMNS: Final = 2
_WIDTH: Final = 4.8
_HEIGHT: Final = 3.2
"""The size of a panel is these two [inch]."""


def styled() -> Any:
    """A context with the settings of all figures."""
    return mpl.rc_context(_SETTINGS)


def write(
    figure: Figure, path: Path, suffixes: Sequence[str] = (".svg", ".png"), dpi: int = DPI
) -> list[Path]:
    """Write a figure once for each suffix; equal figures make equal bytes.

    Args:
        figure: drawn within `styled`, which must still be entered.
        path: without suffix.
        suffixes: `.svg`, `.png` or both.
        dpi: of a picture in pixels.

    Returns:
        The files, in the order of `suffixes`.
    """
    FigureCanvasAgg(figure)
    no_time: dict[str, Any] = {".svg": {"Date": None, "Creator": None}, ".png": {"Software": None}}
    written = [path.with_name(path.name + suffix) for suffix in suffixes]
    for suffix, file in zip(suffixes, written, strict=True):
        figure.savefig(file, dpi=dpi, metadata=no_time[suffix])
    return written


def legend_of(figure: Figure, panels: Iterable[Axes], **place: Any) -> None:
    """Add one legend for all panels, each name once; what is in every panel comes last.

    Args:
        figure: of the panels.
        panels: with names on what they show.
        place: what `Figure.legend` takes, e.g. `loc`.
    """
    found = [axes.get_legend_handles_labels() for axes in panels]
    entries = {
        name: handle
        for handles, names in found
        for handle, name in zip(handles, names, strict=True)
    }
    everywhere = {name for name in entries if all(name in names for _, names in found)}
    ordered = sorted(entries, key=lambda name: name in everywhere)
    figure.legend([entries[name] for name in ordered], ordered, **place)


def draw_panels(panels: Mapping[str, Panel], path: Path, suffix: str = ".svg") -> Path:
    """Draw panels, two side by side, each under its name, as a page.

    Args:
        panels: by name, at least one.
        path: without suffix.
        suffix: `.svg` or `.png`.

    Returns:
        The file.
    """
    columns = min(_COLUMNS, len(panels))
    rows = -(-len(panels) // columns)
    with styled():
        figure = Figure(figsize=(_WIDTH * columns, _HEIGHT * rows), layout="constrained")
        for k, (name, panel) in enumerate(panels.items()):
            axes = figure.add_subplot(rows, columns, k + 1)
            axes.set_title(name, loc="left")
            panel(axes)
        return write(figure, path, (suffix,))[0]
