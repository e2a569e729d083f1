"""A rate over another quantity: a curve that rises, in every resample of a bootstrap.

The seeds are the independent draws of a study: under the same seed all conditions meet the same
traffic (common random numbers). So seeds are resampled, with all their runs, and what is computed
from several conditions has the interval that belongs to its pairing.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import lru_cache
from typing import Final, TypeAlias

import numpy as np
import numpy.typing as npt

from orchestrator.intervals import Estimate

Float: TypeAlias = npt.NDArray[np.float64]

RESAMPLES: Final = 4000
"""The number of resamples of a bootstrap: 100 of them lie beyond each bound of 95 %."""

_SEED: Final = 20_230_601
"""The seed of the bootstrap: equal runs make equal intervals."""

_LEVEL: Final = 0.95
"""The probability that intervals are made for."""


@dataclass(frozen=True, slots=True)
class Resampling:
    """How often each seed is drawn: once in the first row, as it was, and by chance in the others.

    Attributes:
        seeds: the seeds of all conditions that are compared.
        weights: number of draws of each seed, shape (resamples + 1, seeds).
    """

    seeds: tuple[int, ...]
    weights: Float

    @staticmethod
    def of(seeds: Iterable[int], resamples: int = RESAMPLES) -> "Resampling":
        """Draw from `seeds` with replacement (Efron, Annals of Statistics 7(1), 1979)."""
        each = tuple(sorted(set(seeds)))
        return Resampling(each, _weights(len(each), resamples))


@dataclass(frozen=True, slots=True)
class Curve:
    """Rates over positions, in every resample; the first one is what was measured.

    Attributes:
        position: where the points lie, rising along them, in the unit of the axis,
            shape (resamples + 1, points).
        rate: shares, 0 to 1, shape (resamples + 1, points).
        trials: number of runs, shape (resamples + 1, points).
    """

    position: Float
    rate: Float
    trials: Float

    @staticmethod
    def of(position: Float, rate: Float, trials: Float) -> "Curve":
        """Order points by their positions.

        Args:
            position: where the points lie, in the unit of the axis, shape (resamples + 1, points).
            rate: shares, 0 to 1, of the same shape.
            trials: number of runs, of the same shape.
        """
        order = np.argsort(position, axis=1, kind="stable")
        parts = (position, rate, trials)
        return Curve(*(np.take_along_axis(part, order, axis=1) for part in parts))

    @property
    def rising(self) -> Float:
        r"""The most likely rates that do not fall along the curve.

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
        """The position from which on the rising curve is at least `level`.

        Between the points the curve is straight.

        Args:
            level: a share, 0 to 1.

        Returns:
            Positions, in the unit of the axis, shape (resamples + 1,): -inf where the curve is
            there from its first point on, inf where it never is.
        """
        rates, m = self.rising, self.rate.shape[1]
        reached = rates >= level
        above = np.where(reached.any(axis=1), reached.argmax(axis=1), m)
        left, right = np.clip(above - 1, 0, m - 1), np.clip(above, 0, m - 1)
        at = np.arange(len(rates))
        rise = rates[at, right] - rates[at, left]
        share = (level - rates[at, left]) / np.where(rise > 0.0, rise, 1.0)
        inside = self.position[at, left] + share * (
            self.position[at, right] - self.position[at, left]
        )
        found: Float = np.where(above == 0, -np.inf, np.where(above == m, np.inf, inside))
        return found

    def at(self, position: Float) -> Float:
        """The rising curve at one position per resample, constant beyond its ends.

        Args:
            position: where to look, in the unit of the axis, shape (resamples + 1,).

        Returns:
            Shares, 0 to 1, shape (resamples + 1,).
        """
        rates = self.rising
        each = zip(position, self.position, rates, strict=True)
        return np.array([np.interp(x, xs, ys) for x, xs, ys in each], np.float64)


def interval(values: Float) -> Estimate | None:
    """What was measured, and the interval of 95 % between percentiles of the resamples.

    Efron and Tibshirani, An Introduction to the Bootstrap, 1993, section 13.3. Bounds can be
    infinite where the values are; `None` if what was measured is not a number.

    Args:
        values: a quantity of any unit, shape (resamples + 1,), the first one measured.
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
