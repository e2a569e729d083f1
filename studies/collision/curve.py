"""Collision rate over packet error rate: a curve that rises, resampled by seeds.

The seeds are the independent draws of the study: under the same seed all conditions meet the same
traffic (common random numbers). So seeds are resampled, with all their runs, and what is computed
from several conditions has the interval that belongs to its pairing.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Final, TypeAlias

import numpy as np
import numpy.typing as npt

from orchestrator.intervals import Estimate
from studies.collision.runs import Point

Float: TypeAlias = npt.NDArray[np.float64]

RESAMPLES: Final = 4000
"""Of the bootstrap: the bounds of an interval of 95 % have 100 of them outside, each."""

_SEED: Final = 20_230_601
"""Of the bootstrap: equal runs make equal intervals."""

_LEVEL: Final = 0.95


@dataclass(frozen=True, slots=True)
class Resampling:
    """How often each seed is drawn: once in the first row, as it was, and by chance in the others.

    Attributes:
        seeds: of all conditions that are compared.
        weights: shape (resamples + 1, seeds).
    """

    seeds: tuple[int, ...]
    weights: Float

    @staticmethod
    def of(points: Sequence[Point], resamples: int = RESAMPLES) -> "Resampling":
        """Of all seeds of `points`, with replacement (Efron, Annals of Statistics 7(1), 1979)."""
        seeds = tuple(sorted({seed for point in points for seed in point.runs}))
        return Resampling(seeds, _weights(len(seeds), resamples))


@dataclass(frozen=True, slots=True)
class Curve:
    """Collision rates over packet error rates, in every resample; the first is what was measured.

    Attributes:
        per: shape (resamples + 1, points), rising along the points.
        rate: shape (resamples + 1, points).
        trials: number of runs, shape (resamples + 1, points).
    """

    per: Float
    rate: Float
    trials: Float

    @staticmethod
    def of(points: Sequence[Point], resampling: Resampling) -> "Curve":
        """Through `points`; resamples that have no run of one of them are left out."""
        per, rate, trials = _resampled(points, resampling)
        order = np.argsort(per, axis=1, kind="stable")
        return Curve(*(np.take_along_axis(part, order, axis=1) for part in (per, rate, trials)))

    @property
    def rising(self) -> Float:
        r"""The most likely rates that do not fall with the packet error rate.

        Shape (resamples + 1, points). Isotonic regression of shares is their maximum likelihood
        under that order (Ayer, Brunk, Ewing, Reid and Silverman, Annals of Mathematical Statistics
        26(4), 1955), by the max-min formula

        $$ g_i = \max_{s \le i} \min_{t \ge i} \overline{y}_{s..t} $$

        (Robertson, Wright and Dykstra, Order Restricted Statistical Inference, 1988, section 1.4).
        """
        m = self.rate.shape[1]
        lowest = np.full((*self.rate.shape, m), -np.inf)  # by s and i
        zero = np.zeros((len(self.rate), 1))
        hits = np.hstack([zero, np.cumsum(self.rate * self.trials, axis=1)])
        trials = np.hstack([zero, np.cumsum(self.trials, axis=1)])
        for s in range(m):
            means = (hits[:, s + 1 :] - hits[:, [s]]) / (trials[:, s + 1 :] - trials[:, [s]])
            lowest[:, s, s:] = np.minimum.accumulate(means[:, ::-1], axis=1)[:, ::-1]
        highest: Float = lowest.max(axis=1)
        return highest

    def crossing(self, level: float) -> Float:
        """The packet error rate from which on the rising curve is at least `level`.

        Shape (resamples + 1,). Between the points the curve is straight. -inf where the curve is
        there from its first point on, inf where it never is.
        """
        rates, m = self.rising, self.rate.shape[1]
        reached = rates >= level
        above = np.where(reached.any(axis=1), reached.argmax(axis=1), m)
        left, right = np.clip(above - 1, 0, m - 1), np.clip(above, 0, m - 1)
        at = np.arange(len(rates))
        rise = rates[at, right] - rates[at, left]
        share = (level - rates[at, left]) / np.where(rise > 0.0, rise, 1.0)
        inside = self.per[at, left] + share * (self.per[at, right] - self.per[at, left])
        found: Float = np.where(above == 0, -np.inf, np.where(above == m, np.inf, inside))
        return found

    def at(self, per: Float) -> Float:
        """The rising curve at `per`, shape (resamples + 1,); constant beyond its ends."""
        rates = self.rising
        each = zip(per, self.per, rates, strict=True)
        return np.array([np.interp(x, xs, ys) for x, xs, ys in each], np.float64)


def rate(point: Point, resampling: Resampling) -> Float:
    """The collision rate in every resample, shape (resamples + 1,)."""
    return _resampled([point], resampling)[1][:, 0]


def measured_per(point: Point, resampling: Resampling) -> Float:
    """The packet error rate in every resample, shape (resamples + 1,)."""
    return _resampled([point], resampling)[0][:, 0]


def interval(values: Float) -> Estimate | None:
    """What was measured, and the interval of 95 % between percentiles of the resamples.

    Efron and Tibshirani, An Introduction to the Bootstrap, 1993, section 13.3. Bounds can be
    infinite where the values are; `None` if there is nothing in the first one.
    """
    if np.isnan(values[0]):
        return None
    known = np.sort(values[1:][~np.isnan(values[1:])])
    if len(known) == 0:
        return Estimate(float(values[0]), None, None)
    tail = (1.0 - _LEVEL) / 2.0
    low, high = (
        known[int(np.floor(tail * (len(known) - 1)))],
        known[int(np.ceil((1.0 - tail) * (len(known) - 1)))],
    )
    return Estimate(float(values[0]), float(low), float(high))


@lru_cache(maxsize=8)
def _weights(n: int, resamples: int) -> Float:
    rng = np.random.default_rng(_SEED)
    drawn = rng.multinomial(n, np.full(n, 1.0 / n), size=resamples)
    weights = np.vstack([np.ones((1, n)), drawn]).astype(np.float64)
    weights.flags.writeable = False
    return weights


def _resampled(points: Sequence[Point], resampling: Resampling) -> tuple[Float, Float, Float]:
    """Packet error rates, collision rates, numbers of runs, shape (resamples + 1, points) each.

    A resample without a run of a point gets the mean of all its runs, with no weight to speak of.
    """
    runs = [[point.runs.get(seed) for point in points] for seed in resampling.seeds]
    counts = [  # what to sum, shape (seeds, points) each
        [[run is not None for run in row] for row in runs],
        [[run is not None and run.collision for run in row] for row in runs],
        [[run is not None and run.per is not None for run in row] for row in runs],
        [[0.0 if run is None or run.per is None else run.per for run in row] for row in runs],
    ]
    parts = np.array(counts, np.float64).reshape(4, len(resampling.seeds), len(points))
    trials, hits, known, errors = (resampling.weights @ part for part in parts)
    per = _ratio(errors, known)
    for k, point in enumerate(points):
        if point.condition.per is not None:
            per[:, k] = point.condition.per
    return per, _ratio(hits, trials), np.maximum(trials, 1e-9)


def _ratio(sums: Float, weights: Float) -> Float:
    """Means; where nothing was drawn, that of the first row."""
    with np.errstate(invalid="ignore"):
        first = sums[0] / weights[0]
    found: Float = np.where(weights > 0.0, sums / np.where(weights > 0.0, weights, 1.0), first)
    return found
