"""Layers: what packages add to the page of a run, found by entry points.

The page itself knows components, signals and numbers. Who knows what the signals mean draws
them: a layer reads the recording when the page is made, and has scripts that show it later.
"""

import abc
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

import numpy as np

from orchestrator.installed import installed_class, offers
from orchestrator.page.arrays import Arrays, Reference
from orchestrator.recording.reader import Recording
from orchestrator.signal import Array
from orchestrator.timebase import Time

GROUP: Final = "orchestrator.page_layers"

_TICKS: Final = 1 << 30
"""A run has no more."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Curve:
    """Numbers over time that are not recorded but follow from what is.

    Attributes:
        name: on the page.
        unit: of the values; `1` if there is none.
        times: [ns], int64, ascending, shape (n,).
        values: shape (n,); NaN where there is none.
        holds: whether a value holds until the next one; if not, there is a line between them.
        shown: whether the page shows it when it opens.
    """

    name: str
    unit: str
    times: Array
    values: Array
    holds: bool = False
    shown: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Content:
    """What a layer shows of a run.

    Attributes:
        data: for its scripts: what JSON can say. Arrays are in it as `PageOfRun` refers to them.
        curves: beside those of the recorded numbers.
        shown: names of recorded numbers that the page shows when it opens.
    """

    data: Mapping[str, Any]
    curves: Sequence[Curve] = ()
    shown: Sequence[str] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class PageOfRun:
    """The run that a page is made of, and where arrays for the page are put.

    Attributes:
        recording: of the run.
        manifest: of the run.
        arrays: of the page.
        start, stop: the first and the last communication point [ns].
    """

    recording: Recording
    manifest: Mapping[str, Any]
    start: Time
    stop: Time
    arrays: Arrays = field(default_factory=Arrays)

    @property
    def tick(self) -> int:
        """The unit of times on the page [ns]: a power of ten, of which a run has at most 2^30."""
        tick = 1
        while (self.stop - self.start) // tick > _TICKS:
            tick *= 10
        return tick

    def times(self, times: Array, unit: int = 1) -> Reference:
        """Keep times.

        Args:
            times: [ns], int64, any shape; before the start counts as the start.
            unit: to which they are cut off [ns], if it is more than a tick.

        Returns:
            What a script gives to `NLOSIM.times` for it, which returns seconds since the start.
        """
        unit = max(unit, self.tick)
        whole = ((np.asarray(times, np.int64) - self.start) // unit).clip(0, 2 * _TICKS - 1)
        return {"whole": self.arrays.add(whole, "i4", deltas=2), "unit": unit / 1e9}


class PageLayer(abc.ABC):
    """Adds to the page of a run what only it knows how to read and draw.

    It has no state and needs no parameters. Its scripts put an object with the function
    `start(page, data)` at `NLOSIM.layers.NAME`, where `NAME` is that of the entry point; `data` is
    what `content` said. docs/run-page.md shows a complete one.
    """

    @abc.abstractmethod
    def content(self, run: PageOfRun) -> Content | None:
        """What there is to show of a run; `None`: nothing, and the scripts are left out.

        Raises:
            RecordingError: a signal cannot be read; the page says so in the place of the layer.
            ValueError: likewise.
        """

    @abc.abstractmethod
    def scripts(self) -> Sequence[Path]:
        """Files of JavaScript, in the order in which they are run."""

    def styles(self) -> Sequence[Path]:
        """Files of CSS."""
        return ()


def installed() -> Iterator[tuple[str, type[PageLayer]]]:
    """The layers that packages offer, by name.

    Raises:
        ComponentTypeError: one cannot be loaded.
    """
    for name in offers(GROUP):
        yield name, installed_class(GROUP, name, PageLayer, "layer of pages")  # type: ignore[type-abstract]
