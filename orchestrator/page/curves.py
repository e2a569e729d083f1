"""The time lines of a page: recorded numbers, thinned out where nobody would see the difference."""

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Final

import numpy as np

from orchestrator.elements import Elements
from orchestrator.page.layer import Curve, PageOfRun
from orchestrator.recording.declared import declared_shape
from orchestrator.recording.layout import RecordingError
from orchestrator.recording.reader import Series
from orchestrator.signal import Array

MOST_CURVES: Final = 240
"""Recorded numbers that have a place on the page."""

MOST_ELEMENTS: Final = 9
"""Arrays of constant shape with up to so many elements are taken apart."""

_POINTS: Final = 240_000
"""All curves together have no more, but for those of the least parts."""

_LEAST: Final = 200
"""A curve is cut into so many parts at least; of each the least and the greatest value stay."""

_MOST: Final = 1500
_CHARTS: Final = 4
_IN_A_CHART: Final = 4
"""What is shown when the page opens, if no layer says it."""


def curves_of(run: PageOfRun, more: Sequence[Curve], shown: Sequence[str]) -> Mapping[str, Any]:
    """The curves of a page, as its JSON says them.

    Args:
        run: whose recorded numbers are meant.
        more: curves of the layers.
        shown: names of recorded numbers that are shown when the page opens.
    """
    found = list(_recorded(run))
    kept = found[:MOST_CURVES]
    wanted = {curve.name for curve in more if curve.shown} | set(shown)
    if not wanted & {curve.name for curve in (*more, *kept)}:
        wanted = _first(kept)
    every = (*more, *kept)
    order = dict.fromkeys([*shown, *(curve.name for curve in every)])
    parts = int(np.clip(_POINTS // (2 * max(1, len(every))), _LEAST, _MOST))
    return {
        "curves": [_packed(run, curve, parts) for curve in every],
        "shown": [name for name in order if name in wanted],
        "not_here": [curve.name for curve in found[MOST_CURVES:]],
        "thinned": any(len(curve.times) > 2 * parts for curve in every),
    }


def _recorded(run: PageOfRun) -> Iterator[Curve]:
    """Every recorded number that is a single one at each time, those that change."""
    for name in run.recording.signals:
        shape = declared_shape(run.recording.kind(name))
        if shape is None or any(isinstance(length, str) for length in shape):
            continue
        lengths = [int(length) for length in shape]
        if math.prod(lengths) > MOST_ELEMENTS:
            continue
        try:
            series = run.recording[name]
            if len(series) < 2:
                continue
            values = np.asarray(series.values).reshape(len(series), -1)
        except RecordingError:  # damaged: what is whole is shown
            continue
        for column, index in enumerate(np.ndindex(*lengths)):
            yield _curve(series, f"{name}{Elements(index)}", values[:, column])


def _curve(series: Series, name: str, values: Array) -> Curve:
    holds = values.dtype.kind in "biu"
    return Curve(name=name, unit=series.unit, times=series.times, values=values, holds=holds)


def _first(curves: Sequence[Curve]) -> set[str]:
    """The first few that change, by unit, components together."""
    charts: dict[tuple[str, bool], list[str]] = {}
    for curve in curves:
        values = curve.values
        if len(values) and bool((values != values[0]).any()):
            charts.setdefault((curve.unit, curve.holds), []).append(curve.name)
    best = sorted(charts.items(), key=lambda each: each[0][1])[:_CHARTS]
    return {name for _, names in best for name in names[:_IN_A_CHART]}


def _packed(run: PageOfRun, curve: Curve, parts: int) -> Mapping[str, Any]:
    keep = thinned(np.asarray(curve.values, np.float64), parts)
    values = np.asarray(curve.values)[keep]
    return {
        "name": curve.name,
        "unit": "" if curve.unit == "1" else curve.unit,
        "times": run.times(curve.times[keep]),
        "holds": curve.holds,
        **_values(run, values),
    }


def _values(run: PageOfRun, values: Array) -> Mapping[str, Any]:
    """Whole numbers as they are where they fit, others with 16 bits."""
    if values.dtype.kind in "biu":
        whole = values.astype(np.int64)
        if len(whole) and whole.min() >= -(2**31) and whole.max() < 2**31:
            return {"whole": run.arrays.add(whole, "i4", deltas=1)}
    return {"numbers": run.arrays.rounded(values)}


def thinned(values: Array, parts: int) -> Array:
    """Which values are enough to draw a curve: the least and the greatest of each part.

    Args:
        values: shape (n,).
        parts: into how many stretches of equal numbers of values it is cut.

    Returns:
        Indices, ascending, with the first and the last one; all of them where there are no more
        than two for each part.
    """
    count = len(values)
    if count <= 2 * parts:
        return np.arange(count)
    size = -(-count // parts)
    padded = np.full(size * -(-count // size), np.nan)
    padded[:count] = values
    rows = padded.reshape(-1, size)
    known = ~np.isnan(rows)
    low = np.where(known, rows, np.inf).argmin(axis=1)
    high = np.where(known, rows, -np.inf).argmax(axis=1)
    first = np.arange(len(rows)) * size
    found = np.concatenate([[0, count - 1], first + low, first + high])
    return np.unique(found[found < count])
