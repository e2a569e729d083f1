"""What the earlier assumption, a constant packet error rate, gets wrong."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from orchestrator.intervals import Estimate, wilson
from studies.collision import curve as curve_of
from studies.collision.condition import COOPERATIVE, SIMULATED
from studies.collision.curve import Curve, Float, Resampling, interval
from studies.collision.curves import constant_curve, curves, distinct
from studies.collision.rates import collision_rate, difference
from studies.collision.runs import Point
from studies.method.estimates import columns


def rows(points: Sequence[Point]) -> list[dict[str, Any]]:
    """One row per point of the cooperative policy over the simulated channel.

    `assumed` is the collision rate that the curve over constant rates has at the packet error rate
    that was measured, `difference` the measured `rate` minus it. Points without a curve of their
    compression and speed are left out.
    """
    known = curves(points)
    return [
        _row(point, constant)
        for point in distinct(points)
        if point.condition.policy == COOPERATIVE
        and point.condition.channel == SIMULATED
        and any(run.per is not None for run in point.runs.values())
        and (constant := constant_curve(known, point.condition))
    ]


def _row(point: Point, constant: Sequence[Point]) -> dict[str, Any]:
    resampling = Resampling.of([point, *constant])
    per = curve_of.measured_per(point, resampling)
    assumed = _assumed(Curve.of(constant, resampling).at(per), constant)
    measured = collision_rate(point)
    condition = point.condition
    return {
        "experiment": point.experiment,
        "relay": condition.relay,
        "compression": condition.compression,
        "speed_kmh": condition.speed_kmh,
        "load": condition.load,
        "granularity": condition.granularity,
        "transmit_power": condition.transmit_power,
        **columns("per", interval(per)),
        **columns("rate", measured),
        **columns("assumed", assumed),
        **columns("difference", None if measured is None else difference(measured, assumed)),
    }


def _assumed(rates: Float, constant: Sequence[Point]) -> Estimate:
    """By bootstrap, but not surer than a rate that was counted in as many runs (Wilson)."""
    n = min(len(point.runs) for point in constant)
    low, high = wilson(rates[:1] * n, np.array([float(n)]))
    found = interval(rates)
    if found is None or found.low is None or found.high is None:
        return Estimate(float(rates[0]), float(low[0]), float(high[0]))
    return Estimate(found.value, min(found.low, float(low[0])), max(found.high, float(high[0])))
