"""What the figures of a verification show, apart from how: few enough numbers to keep in a file.

Pictures are drawn from this alone, so that they can be drawn again without a comparison.
"""

import json
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Final, Self

import numpy as np
from pydantic import TypeAdapter

from orchestrator.signal import Array
from studies.verification.channel.comparison import Comparison, Series
from studies.verification.channel.fading import FADING_STATISTICS
from studies.verification.channel.link_budget import ANTENNA, PATH_LOSS
from studies.verification.channel.reception import ERROR_RATE, MIN_SNIR
from studies.verification.channel.shadowing import BUILDINGS, KNIFE_EDGES, VEHICLES

FILE: Final = "figures.json"
"""The name of the file beside the pictures."""

SINGLE: Final = (PATH_LOSS, BUILDINGS, VEHICLES, KNIFE_EDGES, ANTENNA, MIN_SNIR)
"""The files of single values."""

LEAST: Final = 1e-17
"""Smaller errors are drawn as none: they are less than a bit of a double."""

_PER_DECADE: Final = 4
_SPECIAL: Final = "special"

Numbers = tuple[float, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Kind:
    """Cases of one kind: `golden` values, and the sizes of the errors of ours."""

    label: str
    golden: Numbers
    error: Numbers


@dataclass(frozen=True, slots=True, kw_only=True)
class Values:
    """A file of single values [dB]."""

    name: str
    tolerance: float
    kinds: tuple[Kind, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Rate:
    """Probabilities that packets of one bit rate are decoded, over the SNIR [dB].

    Attributes:
        label: the bit rate.
        snir: [dB].
        golden: at each of them, of the longest and of the shortest packet.
        ours: likewise.
    """

    label: str
    snir: Numbers
    golden: tuple[Numbers, Numbers]
    ours: tuple[Numbers, Numbers]


@dataclass(frozen=True, slots=True, kw_only=True)
class Errors:
    """How many values of a file have an error of a size.

    Attributes:
        name: of the file, or of the run.
        unit: `dB`, or `1` of probabilities.
        tolerance: the largest error that passes.
        zeros: how many have none.
        exponents: log10 of the least error of each bin; bins are a quarter of a decade wide.
        counts: of the others, by bin.
    """

    name: str
    unit: str
    tolerance: float
    zeros: int
    exponents: Numbers
    counts: tuple[int, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Ratio:
    """Frames received over the distance [m] of links of one class: golden and ours of `events`."""

    link: str
    distance: Numbers
    events: tuple[int, ...]
    golden: tuple[int, ...]
    ours: tuple[int, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Run:
    """A run of the whole stack in which several classes of links occur."""

    name: str
    ratios: tuple[Ratio, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Shown:
    """All of it.

    Attributes:
        values, rates, errors, runs: what there are data for.
        fading: differences of statistics [standard deviations].
    """

    values: tuple[Values, ...]
    rates: tuple[Rate, ...]
    errors: tuple[Errors, ...]
    fading: Numbers
    runs: tuple[Run, ...]

    @classmethod
    def of(cls, files: Mapping[str, Comparison]) -> Self:
        """What is to be shown of comparisons, by the name of the file."""
        found = {name: comparison for name, comparison in files.items() if comparison.series}
        fading = found[FADING_STATISTICS].series[0].x if FADING_STATISTICS in found else np.empty(0)
        return cls(
            values=tuple(_values(name, found[name]) for name in SINGLE if name in found),
            rates=tuple(_rates(found[ERROR_RATE])) if ERROR_RATE in found else (),
            errors=tuple(_errors(n, one) for n, one in found.items() if one.unit != "sigma"),
            fading=_numbers(fading),
            runs=tuple(_runs(found)),
        )

    @classmethod
    def read(cls, folder: Path) -> Self:
        """What `write` wrote into `folder`.

        Raises:
            FileNotFoundError: nothing.
            ValueError: it is something else.
        """
        return TypeAdapter(cls).validate_json((folder / FILE).read_bytes())

    def write(self, folder: Path) -> None:
        """Keep it in `folder`, so that pictures can be drawn again."""
        text = json.dumps(asdict(self), separators=(",", ":")).replace("],", "],\n")
        (folder / FILE).write_text(text + "\n", encoding="utf-8")


def _numbers(values: Array, digits: int = 6) -> Numbers:
    return tuple(float(f"{value:.{digits}g}") for value in values)


def _values(name: str, comparison: Comparison) -> Values:
    kinds: dict[str, list[Series]] = {}
    for one in comparison.series:
        label = "special cases" if one.label.startswith(_SPECIAL) else one.label.replace("_", " ")
        kinds.setdefault(label, []).append(one)
    return Values(
        name=name,
        tolerance=comparison.tolerance,
        kinds=tuple(
            Kind(
                label=label,
                golden=_numbers(np.concatenate([one.golden for one in series])),
                error=_numbers(np.concatenate([abs(one.ours - one.golden) for one in series]), 3),
            )
            for label, series in kinds.items()
        ),
    )


def _rates(comparison: Comparison) -> Iterator[Rate]:
    for one in comparison.series:
        if "packet" in one.label:
            snir = np.unique(one.x)
            golden, ours = (_extremes(one.x, y) for y in (one.golden, one.ours))
            label = one.label.split(",")[0]
            yield Rate(label=label, snir=_numbers(snir), golden=golden, ours=ours)


def _extremes(x: Array, y: Array) -> tuple[Numbers, Numbers]:
    """The smallest and the largest y of each x, by ascending x."""
    places, index = np.unique(x, return_inverse=True)
    low, high = np.full(len(places), np.inf), np.full(len(places), -np.inf)
    np.minimum.at(low, index, y)
    np.maximum.at(high, index, y)
    return _numbers(low), _numbers(high)


def _errors(name: str, comparison: Comparison) -> Errors:
    each = [np.abs(one.ours - one.golden) for one in comparison.series]
    first = each[:1] if name.startswith("stack/") else each  # the received powers
    errors = np.concatenate(first)
    bins = np.floor(_PER_DECADE * np.log10(errors[errors >= LEAST])).astype(int)
    places, counts = np.unique(bins, return_counts=True)
    return Errors(
        name=name.removeprefix("stack/"),
        unit=comparison.unit,
        tolerance=comparison.tolerance,
        zeros=int((errors < LEAST).sum()),
        exponents=_numbers(places / _PER_DECADE),
        counts=tuple(counts.tolist()),
    )


def _runs(files: Mapping[str, Comparison]) -> Iterator[Run]:
    for name, comparison in files.items():
        ratios = comparison.stack.ratios if comparison.stack else ()
        if len(ratios) > 1:
            yield Run(
                name=name.removeprefix("stack/"),
                ratios=tuple(
                    Ratio(
                        link=one.link,
                        distance=_numbers(one.distance),
                        events=tuple(int(n) for n in one.events),
                        golden=tuple(int(n) for n in one.golden),
                        ours=tuple(int(n) for n in one.ours),
                    )
                    for one in ratios
                ),
            )
