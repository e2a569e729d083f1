"""The table of the study: collisions, successes and times under every condition."""

import math
from collections.abc import Sequence
from typing import Any

from orchestrator.intervals import Estimate, share
from studies.collision.completion import Times, expert_times, weighted_successes
from studies.collision.condition import COOPERATIVE
from studies.collision.runs import Point, Run
from studies.method.estimates import columns, estimate


def rows(points: Sequence[Point]) -> list[dict[str, Any]]:
    """One row per point.

    `rate` is the share of runs with a collision and `success` that of successes, with the intervals
    of Wilson; `per` is the packet error rate that is set, or the mean of the measured ones, whose
    interval `per_low` to `per_high` is (Student's t over runs). `begin` [s] is the mean time of the
    first trigger of fusion, `unserved` the mean share of scans since then of which no whole message
    reached the cooperative policy, 1 in runs without a trigger: other than `per` it counts what was
    never sent. `sct` is the success weighted by
    completion time, over `sct_n` seeds that the expert solved; without runs of the expert at that
    speed there is none. `completion_time` [s] is the mean over the runs that were completed.
    """
    times = expert_times(points)
    return [_row(point, times) for point in points]


def collision_rate(point: Point) -> Estimate | None:
    """The share of runs with a collision; `None` without runs."""
    return _share([run.collision for run in point.runs.values()])


def difference(a: Estimate, b: Estimate) -> Estimate:
    """`a` minus `b`, with the interval from those of both, as if they were independent.

    Squares of the distances to the bounds are added (Newcombe, Statistics in Medicine 17, 1998,
    method 10). Unlike a bootstrap it knows that a rate of 0 is not certain; that both have the same
    traffic is not used, so the interval is rather too wide.
    """
    if a.low is None or a.high is None or b.low is None or b.high is None:
        return Estimate(a.value - b.value, None, None)
    below = math.hypot(a.value - a.low, b.high - b.value)
    above = math.hypot(a.high - a.value, b.value - b.low)
    return Estimate(a.value - b.value, a.value - b.value - below, a.value - b.value + above)


def _row(point: Point, times: Times) -> dict[str, Any]:
    condition, runs = point.condition, list(point.runs.values())
    rate, success = collision_rate(point), _share([run.success for run in runs])
    per = estimate([run.per for run in _by_seed(point) if run.per is not None])
    sct = weighted_successes(point, times)
    begin = estimate([run.begin for run in _by_seed(point) if run.begin is not None])
    unserved = _unserved(point)
    done = [r.completion_time for r in _by_seed(point) if r.completion_time is not None]
    measured = columns("per", per)
    return {
        "policy": condition.policy,
        "relay": condition.relay,
        "compression": condition.compression,
        "speed_kmh": condition.speed_kmh,
        "per": measured["per"] if condition.per is None else condition.per,
        "runs": len(runs),
        "collisions": sum(run.collision for run in runs),
        "rate": None if rate is None else rate.value,
        "low": None if rate is None else rate.low,
        "high": None if rate is None else rate.high,
        "experiment": point.experiment,
        "channel": condition.channel,
        "load": condition.load,
        "granularity": condition.granularity,
        "maximum_age": condition.maximum_age,
        "transmit_power": condition.transmit_power,
        "per_low": measured["per_low"],
        "per_high": measured["per_high"],
        **columns("begin", begin),
        **columns("unserved", unserved),
        **columns("success", success),
        **columns("sct", estimate(sct)),
        "sct_n": len(sct),
        **columns("completion_time", estimate(done)),
    }


def _unserved(point: Point) -> Estimate | None:
    if point.condition.policy != COOPERATIVE:
        return None
    return estimate([1.0 - (run.served or 0.0) for run in _by_seed(point)])


def _by_seed(point: Point) -> list[Run]:
    return [point.runs[seed] for seed in sorted(point.runs)]


def _share(values: list[bool]) -> Estimate | None:
    return share(values) if values else None
