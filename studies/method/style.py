"""How the figures of studies look, and how they are written."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from orchestrator.drawing import DPI
from orchestrator.intervals import Estimate


@dataclass(frozen=True, slots=True)
class Look:
    """How one method is drawn.

    Attributes:
        name: what legends call it.
        colour: of Okabe and Ito's palette, which readers with colour blindness can tell apart.
        marker: different for every method, for readers without colours.
    """

    name: str
    colour: str
    marker: str


LOOKS: Final[Mapping[str, Look]] = {
    "mohed": Look("MoHeD", "#0072B2", "o"),
    "signal-strength": Look("signal strength, sum", "#D55E00", "s"),
    "signal-strength-min": Look("signal strength, weaker hop", "#E69F00", "D"),
    "random": Look("random", "#009E73", "^"),
    "direct": Look("direct link", "#CC79A7", "v"),
    "expected-prr": Look("expected PRR", "#56B4E9", "P"),
    "oracle": Look("oracle", "#000000", "*"),
}
_OTHERS: Final = (("#666666", "X"), ("#8A6D3B", "<"), ("#9A9A00", ">"), ("#5E3C99", "h"))


def looks(methods: list[str]) -> dict[str, Look]:
    """The look of every method; those that we do not know get what is left."""
    others = iter(_OTHERS * len(methods))
    return {m: LOOKS[m] if m in LOOKS else Look(m, *next(others)) for m in methods}


def method_name(method: str) -> str:
    """What readers call a method."""
    return LOOKS[method].name if method in LOOKS else method


def bars(found: Sequence[Estimate]) -> list[list[float]]:
    """Lengths of the error bars of shares, below and above [%]; none where there is no interval."""
    below = [0.0 if one.low is None else 100 * max(0.0, one.value - one.low) for one in found]
    above = [0.0 if one.high is None else 100 * max(0.0, one.high - one.value) for one in found]
    return [below, above]


def write(figure: Figure, path: Path) -> list[Path]:
    """Write `path` as SVG and PNG; equal figures make equal bytes.

    Args:
        figure: drawn within `orchestrator.drawing.styled`, which must still be entered.
        path: without suffix.
    """
    FigureCanvasAgg(figure)
    vector, raster = path.with_suffix(".svg"), path.with_suffix(".png")
    figure.savefig(vector, metadata={"Date": None, "Creator": None})
    figure.savefig(raster, dpi=DPI, metadata={"Software": None})
    return [vector, raster]
