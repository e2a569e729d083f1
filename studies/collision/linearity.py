"""Is the collision rate a straight line over the packet error rate?"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from orchestrator.intervals import Estimate
from studies.collision.condition import CONSTANT
from studies.collision.curve import Curve, Float, Resampling
from studies.collision.curves import curves
from studies.collision.likelihood import deviance, logistic, straight
from studies.collision.runs import Point


def rows(points: Sequence[Point]) -> list[dict[str, Any]]:
    """One row per curve over constant rates that has a point between its ends.

    `deviation` is the largest distance of the measured rates from the straight line through the two
    ends, with its sign, at the packet error rate `at`. `band` is the half width of a band of 95 %
    around all distances together: the quantile of the largest error over the resamples of seeds,
    which have the errors of the ends in them. `p` is the probability of a deviation as large if the
    curve were straight. `deviance_line` and `deviance_logistic`: how much log-likelihood the best
    straight line and the best logistic curve miss, twice; with `freedom` degrees of freedom that is
    about as much if such a curve were true.
    """
    return [
        {**name.columns(), **_row(points_)}
        for name, points_ in curves(points).items()
        if name.channel == CONSTANT and len(points_) > 2
    ]


def size(row: dict[str, Any]) -> Estimate:
    """The largest distance of the true curve from its chord, with its interval of 95 %.

    If every distance is within `band` of what was measured, so is the largest of them.
    """
    deviation, band = abs(row["deviation"]), row["band"]
    return Estimate(deviation, max(0.0, deviation - band), deviation + band)


def _row(points: Sequence[Point]) -> dict[str, Any]:
    resampling = Resampling.of(points)
    curve = Curve.of(points, resampling)
    position = _position(curve)
    distances = curve.rate - _chord(curve.rate, position)
    errors = np.abs(distances[1:] - distances[0]).max(axis=1)
    worst = int(np.abs(distances[0]).argmax())
    largest = float(np.abs(distances[0]).max())
    hits, trials = np.round(curve.rate[0] * curve.trials[0]), curve.trials[0]
    beyond = int(np.count_nonzero(errors >= largest - 1e-12))
    return {
        "points": len(points),
        "seeds": len(resampling.seeds),
        "deviation": float(distances[0, worst]),
        "band": float(np.quantile(errors, 0.95)),
        "at": float(curve.per[0, worst]),
        "p": (1 + beyond) / (1 + len(errors)),
        "deviance_line": deviance(hits, trials, straight(position, hits, trials)),
        "deviance_logistic": deviance(hits, trials, logistic(position, hits, trials)),
        "freedom": len(points) - 2,
    }


def _position(curve: Curve) -> Float:
    per = curve.per[0]
    found: Float = (per - per[0]) / (per[-1] - per[0])
    return found


def _chord(rates: Float, position: Float) -> Float:
    """The straight line between the first and the last rate, shape of `rates`."""
    first, last = rates[:, [0]], rates[:, [-1]]
    line: Float = first + position * (last - first)
    return line
