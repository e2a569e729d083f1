"""Collision rates over the packet error rate: where they cross levels, how straight they are.

What belongs to one curve is said by `CurveName`; seeds are resampled with all their runs.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from orchestrator.intervals import Estimate, wilson
from studies.collision.conditions import (
    CONSTANT,
    COOPERATIVE,
    DIRECT,
    SIMULATED,
    USUAL_AGE,
    Condition,
)
from studies.collision.runs import Point
from studies.collision.statistics import collision_rate, difference
from studies.method.curve import RESAMPLES, Curve, Float, Resampling, interval
from studies.method.likelihood import deviance, logistic, straight

LEVELS: Final = (0.01, 0.1, 0.5)
"""The collision rates whose crossings are critical points."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CurveName:
    """What the points of a curve have in common.

    Attributes:
        channel: `constant`: over rates that are set; `simulated`: over relay methods.
        compression: that of the features.
        speed_kmh: the speed of the ego [km/h].
        maximum_age: up to which the policy uses features [s].
    """

    channel: str
    compression: int | None
    speed_kmh: float
    maximum_age: float | None = USUAL_AGE

    @staticmethod
    def of(condition: Condition) -> "CurveName":
        """The curve that a condition belongs to, if its load and granularity do."""
        return CurveName(**condition.repeated_in(CurveName))


@dataclass(frozen=True, slots=True, kw_only=True)
class OfCurve:
    """Something that a curve says.

    Attributes:
        curve: the name of the curve.
        points: the number of its points.
        seeds: the number of seeds of all points.
    """

    curve: CurveName
    points: int
    seeds: int


@dataclass(frozen=True, slots=True, kw_only=True)
class CriticalPoint(OfCurve):
    """The packet error rate at which a curve crosses a level.

    Attributes:
        first, last: the packet error rates of its first and its last point, 0 to 1.
        level: a collision rate, 0 to 1.
        per: where the curve, made to rise and straight between its points, crosses the level, 0 to
            1, with the interval of 95 % (bootstrap over seeds). -inf: it is there from its first
            point on; inf: it never is, up to its last point.
    """

    first: float
    last: float
    level: float
    per: Estimate | None


@dataclass(frozen=True, slots=True, kw_only=True)
class Linearity(OfCurve):
    """How far a curve over constant rates is from a straight line.

    Attributes:
        deviation: the largest distance of the measured rates from the straight line through the two
            ends, with its sign.
        band: the half width of a band of 95 % around all distances together: the quantile of the
            largest error over the resamples of seeds, which have the errors of the ends in them.
        at: the packet error rate of the largest distance, 0 to 1.
        p: the probability of a deviation as large if the curve were straight.
        deviance_line: how much log-likelihood the best straight line misses, twice.
        deviance_logistic: how much the best logistic curve misses, twice.
        freedom: the degrees of freedom; if such a curve were true, it would miss about as much.
    """

    deviation: float
    band: float
    at: float
    p: float
    deviance_line: float
    deviance_logistic: float
    freedom: int

    @property
    def size(self) -> Estimate:
        """The largest distance of the true curve from its chord, with its interval of 95 %.

        If every distance is within `band` of what was measured, so is the largest of them.
        """
        deviation = abs(self.deviation)
        return Estimate(deviation, max(0.0, deviation - self.band), deviation + self.band)


@dataclass(frozen=True, slots=True, kw_only=True)
class Assumption:
    """What the earlier assumption, a constant packet error rate, gets wrong under a condition.

    Attributes:
        experiment: the name of the experiment.
        relay, compression, speed_kmh, load, granularity, transmit_power: what they are in the
            `Condition`.
        per: the packet error rate that was measured, 0 to 1.
        rate: the collision rate that was measured, 0 to 1.
        assumed: the collision rate of the curve over constant rates at `per`, 0 to 1.
        difference: `rate` minus `assumed`.
    """

    experiment: str
    relay: str
    compression: int | None
    speed_kmh: float
    load: str
    granularity: str
    transmit_power: float | None
    per: Estimate | None
    rate: Estimate | None
    assumed: Estimate | None
    difference: Estimate | None


def distinct(points: Sequence[Point]) -> list[Point]:
    """One point per condition: what several experiments have is taken from that of most runs."""
    chosen: dict[Condition, Point] = {}
    for point in points:
        best = chosen.get(point.condition)
        if len(point.runs) > (0 if best is None else len(best.runs)):
            chosen[point.condition] = point
    return list(chosen.values())


def curves(points: Sequence[Point]) -> dict[CurveName, list[Point]]:
    """The curves of the cooperative policy, with the load of a probe and losses of whole messages.

    Only curves of two points or more, and only points whose packet error rate is known; those over
    constant rates are of the direct link.
    """
    found: dict[CurveName, list[Point]] = {}
    for point in distinct(points):
        if _belongs(point):
            found.setdefault(CurveName.of(point.condition), []).append(point)
    return {name: each for name, each in found.items() if len(each) > 1}


def _belongs(point: Point) -> bool:
    """Whether `point` belongs to a curve: cooperative and usual, of a known packet error rate.

    None of the constant channel over a relay does: there two losses make one, and the rate that is
    set is not the one end to end.
    """
    condition = point.condition
    if condition.policy != COOPERATIVE or not condition.is_usual:
        return False
    if condition.channel == CONSTANT:
        return condition.relay == DIRECT
    return _is_per_known(point)


def _is_per_known(point: Point) -> bool:
    return any(run.per is not None for run in point.runs.values())


def resampling_of(points: Sequence[Point], resamples: int = RESAMPLES) -> Resampling:
    """The resampling of all seeds of `points`."""
    return Resampling.of((seed for point in points for seed in point.runs), resamples)


def curve_of(points: Sequence[Point], resampling: Resampling) -> Curve:
    """The curve through `points`, over packet error rates."""
    return Curve.of(*_resampled(points, resampling))


def critical_points(points: Sequence[Point]) -> list[CriticalPoint]:
    """The critical points of every curve, at all `LEVELS`."""
    found = []
    for name, each in curves(points).items():
        resampling = resampling_of(each)
        curve = curve_of(each, resampling)
        found += [
            CriticalPoint(
                curve=name,
                points=len(each),
                seeds=len(resampling.seeds),
                first=float(curve.position[0, 0]),
                last=float(curve.position[0, -1]),
                level=level,
                per=interval(curve.crossing(level)),
            )
            for level in LEVELS
        ]
    return found


def linearities(points: Sequence[Point]) -> list[Linearity]:
    """How straight the curves over constant rates are that have a point between their ends."""
    return [
        _linearity(name, each)
        for name, each in curves(points).items()
        if name.channel == CONSTANT and len(each) > 2
    ]


def _linearity(name: CurveName, points: Sequence[Point]) -> Linearity:
    resampling = resampling_of(points)
    curve = curve_of(points, resampling)
    per = curve.position[0]
    position = (per - per[0]) / (per[-1] - per[0])
    distances = curve.rate - _chord(curve.rate, position)
    errors = np.abs(distances[1:] - distances[0]).max(axis=1)
    worst = int(np.abs(distances[0]).argmax())
    largest = float(np.abs(distances[0]).max())
    hits, trials = np.round(curve.rate[0] * curve.trials[0]), curve.trials[0]
    beyond = int(np.count_nonzero(errors >= largest - 1e-12))
    return Linearity(
        curve=name,
        points=len(points),
        seeds=len(resampling.seeds),
        deviation=float(distances[0, worst]),
        band=float(np.quantile(errors, 0.95)),
        at=float(per[worst]),
        p=(1 + beyond) / (1 + len(errors)),
        deviance_line=deviance(hits, trials, straight(position, hits, trials)),
        deviance_logistic=deviance(hits, trials, logistic(position, hits, trials)),
        freedom=len(points) - 2,
    )


def _chord(rates: Float, position: Float) -> Float:
    """The straight line between the first and the last rate, shape of `rates`."""
    first, last = rates[:, [0]], rates[:, [-1]]
    line: Float = first + position * (last - first)
    return line


def assumptions(points: Sequence[Point]) -> list[Assumption]:
    """The points of the cooperative policy over the simulated channel, against constant rates.

    Points without a curve of their compression and speed are left out.
    """
    known = curves(points)
    return [
        _assumption(point, constant)
        for point in distinct(points)
        if point.condition.policy == COOPERATIVE
        and point.condition.channel == SIMULATED
        and _is_per_known(point)
        and (constant := _constant_curve(known, point.condition))
    ]


def _constant_curve(
    known: Mapping[CurveName, list[Point]], like: Condition
) -> Sequence[Point] | None:
    """The curve over constant rates of what else is like `like`."""
    return known.get(replace(CurveName.of(like), channel=CONSTANT))


def _assumption(point: Point, constant: Sequence[Point]) -> Assumption:
    resampling = resampling_of([point, *constant])
    per = _resampled([point], resampling)[0][:, 0]
    assumed = _assumed(curve_of(constant, resampling).at(per), constant)
    measured = collision_rate(point)
    return Assumption(
        **point.condition.repeated_in(Assumption, but=["per"]),
        experiment=point.experiment,
        per=interval(per),
        rate=measured,
        assumed=assumed,
        difference=None if measured is None else difference(measured, assumed),
    )


def _assumed(rates: Float, constant: Sequence[Point]) -> Estimate:
    """The interval by bootstrap, but not surer than a rate counted in as many runs (Wilson).

    Args:
        rates: collision rates of the curve, 0 to 1, shape (resamples + 1,).
        constant: the points of the curve.
    """
    n = min(len(point.runs) for point in constant)
    low, high = wilson(rates[:1] * n, np.array([float(n)]))
    found = interval(rates)
    if found is None or found.low is None or found.high is None:
        return Estimate(float(rates[0]), float(low[0]), float(high[0]))
    return Estimate(found.value, min(found.low, float(low[0])), max(found.high, float(high[0])))


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
