"""Figures of a verification, and how they are written beside its page."""

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from matplotlib.figure import Figure

from orchestrator import drawing

_DPI: Final = 150


@dataclass(frozen=True, slots=True, kw_only=True)
class Drawing:
    """A figure.

    Attributes:
        name: of its file.
        caption: says what it shows.
        figure: as it is drawn.
    """

    name: str
    caption: str
    figure: Figure

    def shown_in(self, folder: str) -> str:
        """The figure as an image of a Markdown page beside `folder`."""
        return f"![{Path(self.name).stem}]({folder}/{self.name})"


def write(drawings: Iterable[Drawing], folder: Path) -> list[Drawing]:
    """Write figures into `folder`; equal results make equal bytes."""
    folder.mkdir(parents=True, exist_ok=True)
    written = []
    with drawing.styled():  # also while the figures are made, one by one
        for one in drawings:
            drawing.write(one.figure, folder / Path(one.name).stem, (".png",), dpi=_DPI)
            written.append(one)
    return written
