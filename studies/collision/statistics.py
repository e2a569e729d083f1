"""The table of the study: collisions, successes and times under every condition, and partners."""

import math
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from orchestrator.intervals import Estimate
from studies.collision.conditions import BY_FEATURES, EXPERT
from studies.collision.runs import RELAY, Point, Run
from studies.method.estimates import mean_of, share_of

Times = Mapping[tuple[float, int], float]
"""When the expert had completed its way [s], by speed [km/h] and seed; where it succeeded."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Result:
    """What the runs under a condition say: a row of the table of the study.

    Attributes:
        policy, relay, compression, speed_kmh: what they are in the `Condition`.
        per: packet error rate that is set, or the mean of the measured ones, 0 to 1.
        runs: the number of runs that did not fail.
        collisions: the number of those with a collision.
        rate: their share, 0 to 1.
        low, high: the interval of Wilson of `rate`.
        experiment: the name of the experiment.
        channel, load, granularity, maximum_age, transmit_power: what they are in the `Condition`.
        per_low, per_high: the interval of the mean of the measured packet error rates.
        begin: mean time of the first trigger of fusion [s].
        unserved: mean share of scans since then of which no whole message reached the cooperative
            policy, 1 in runs without a trigger: other than `per` it counts what was never sent.
        success: the share of runs in which the ego completed its way without a collision.
        sct: success weighted by completion time, over the seeds that the expert solved; none
            without runs of the expert at that speed.
        sct_n: the number of these seeds.
        completion_time: mean time of completion of the runs that were completed [s].
    """

    policy: str
    relay: str
    compression: int | None
    speed_kmh: float
    per: float | None
    runs: int
    collisions: int
    rate: float | None
    low: float | None
    high: float | None
    experiment: str
    channel: str
    load: str
    granularity: str
    maximum_age: float | None
    transmit_power: float | None
    per_low: float | None
    per_high: float | None
    begin: Estimate | None
    unserved: Estimate | None
    success: Estimate | None
    sct: Estimate | None
    sct_n: int
    completion_time: Estimate | None

    @property
    def collision_rate(self) -> Estimate | None:
        """The share of runs with a collision; `None` without runs."""
        return None if self.rate is None else Estimate(self.rate, self.low, self.high)

    @property
    def packet_error_rate(self) -> Estimate | None:
        """The packet error rate; `None` if it is not known."""
        return None if self.per is None else Estimate(self.per, self.per_low, self.per_high)


@dataclass(frozen=True, slots=True, kw_only=True)
class Partner:
    """How often the ego collided with whom, under all conditions of an experiment and policy.

    Attributes:
        experiment: the name of the experiment.
        policy, compression: what they are in the `Condition`.
        partner: the role of the other vehicle.
        collisions: the number of runs with such a collision.
    """

    experiment: str
    policy: str
    compression: int | None
    partner: str
    collisions: int


def results(points: Sequence[Point]) -> list[Result]:
    """The table of the study: one row per point."""
    times = expert_times(points)
    return [_result(point, times) for point in points]


def beside_relay(table: Sequence[Result], experiment: str) -> list[Result]:
    """Rows of the table of all conditions that show what `LOAD` or `RADIO` changed.

    The relay experiment has the runs with a single packet for a message and the usual power; they
    come first, as far as others are there to be compared with them.
    """
    others = [row for row in table if row.experiment == experiment]
    wanted = {_like(row) for row in others}
    single = [row for row in table if row.experiment == RELAY and _like(row) in wanted]
    return [*single, *others]


def partners(points: Sequence[Point]) -> list[Partner]:
    """Collisions by policy, compression and partner, under all conditions of an experiment."""
    found: dict[tuple[str, str, int | None], Counter[str]] = {}
    for point in points:
        key = (point.experiment, point.condition.policy, point.condition.compression)
        counter = found.setdefault(key, Counter())
        counter.update(run.partner or "unknown" for run in point.runs.values() if run.collision)
    return [
        Partner(
            experiment=experiment,
            policy=policy,
            compression=compression,
            partner=partner,
            collisions=counter[partner],
        )
        for (experiment, policy, compression), counter in found.items()
        for partner in sorted(counter)
    ]


def collision_rate(point: Point) -> Estimate | None:
    """The share of runs with a collision; `None` without runs."""
    return share_of([run.collision for run in point.runs.values()])


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


def expert_times(points: Iterable[Point]) -> Times:
    """The times of all runs of the expert that succeeded."""
    return {
        (point.condition.speed_kmh, run.seed): run.completion_time
        for point in points
        if point.condition.policy == EXPERT
        for run in point.runs.values()
        if run.success and run.completion_time is not None
    }


def weighted_successes(point: Point, times: Times) -> list[float]:
    r"""What every seed that the expert solved adds to the success weighted by completion time.

    $$ \mathrm{SCT} = \overline{s \, T_e / \max(T, T_e)} $$

    with the success s (0 or 1), the completion time T, and that of the expert, T_e, in the same
    episode; over the episodes that the expert solved (Cui et al., COOPERNAUT, CVPR 2022, section
    5.2, and its published evaluation). It is at most the success rate of the same episodes.
    """
    found = [(run, times.get((point.condition.speed_kmh, run.seed))) for run in point.ordered]
    return [_weighted(run, expert) for run, expert in found if expert is not None]


def _weighted(run: Run, expert: float) -> float:
    if not run.success or run.completion_time is None:
        return 0.0
    return expert / max(run.completion_time, expert)


def _like(row: Result) -> tuple[object, ...]:
    """What rows have in common that stand beside each other."""
    return (row.policy, row.relay, row.compression, row.speed_kmh)


def _result(point: Point, times: Times) -> Result:
    condition, runs = point.condition, point.ordered
    rate = collision_rate(point)
    per = mean_of([run.per for run in runs if run.per is not None])
    measured = None if per is None else per.value
    sct = weighted_successes(point, times)
    return Result(
        **condition.repeated_in(Result, but=["per"]),
        per=measured if condition.per is None else condition.per,
        runs=len(runs),
        collisions=sum(run.collision for run in runs),
        rate=None if rate is None else rate.value,
        low=None if rate is None else rate.low,
        high=None if rate is None else rate.high,
        experiment=point.experiment,
        per_low=None if per is None else per.low,
        per_high=None if per is None else per.high,
        begin=mean_of([run.begin for run in runs if run.begin is not None]),
        unserved=_unserved(point),
        success=share_of([run.success for run in runs]),
        sct=mean_of(sct),
        sct_n=len(sct),
        completion_time=mean_of(
            [run.completion_time for run in runs if run.completion_time is not None]
        ),
    )


def _unserved(point: Point) -> Estimate | None:
    if point.condition.policy not in BY_FEATURES:
        return None
    return mean_of([1.0 - (run.served or 0.0) for run in point.ordered])
