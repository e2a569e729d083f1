"""How figures look, and the page of panels that measures draw."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

import matplotlib as mpl
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from orchestrator.measure import Panel

_SETTINGS: Final[Any] = {  # matplotlib's types list every name as a literal
    "font.family": "DejaVu Sans",  # comes with matplotlib: the same on every machine
    "font.size": 9.0,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.alpha": 0.25,
    "legend.frameon": False,
    "svg.fonttype": "path",
    "svg.hashsalt": "nlosim",  # identifiers in the file do not vary
}
DPI: Final = 200
"""Pixels per inch of pictures in pixels."""

_COLUMNS: Final = 2
_WIDTH: Final = 4.8
_HEIGHT: Final = 3.2
"""The size of a panel is these two [inch]."""


def styled() -> Any:
    """A context with the settings of all figures."""
    return mpl.rc_context(_SETTINGS)


def draw_panels(panels: Mapping[str, Panel], path: Path) -> None:
    """Draw panels, two side by side, each under its name, into a PNG file at `path`."""
    columns = min(_COLUMNS, len(panels))
    rows = -(-len(panels) // columns)
    with styled():
        figure = Figure(figsize=(_WIDTH * columns, _HEIGHT * rows), layout="constrained")
        for k, (name, panel) in enumerate(panels.items()):
            axes = figure.add_subplot(rows, columns, k + 1)
            axes.set_title(name, loc="left")
            panel(axes)
        FigureCanvasAgg(figure)
        figure.savefig(path, dpi=DPI, metadata={"Software": None})
