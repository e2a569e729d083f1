"""What was there when the ego vehicle had to decide, run by run and under every condition."""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Final, TypeVar

from orchestrator.experiment.report import Results
from orchestrator.intervals import Estimate
from studies.collision.conditions import Condition
from studies.collision.runs import with_conditions
from studies.method import records
from studies.method.estimates import mean_of, share_of

METRICS: Final = {
    "no_return": "measures.decision.no_return_s",
    "there": "measures.decision.there",
    "age": "measures.decision.age_s",
    "sent": "measures.decision.sent",
    "direct_there": "measures.decision.direct",
    "known_before": "measures.decision.known_before_s",
    "seen_before": "measures.decision.seen_before_s",
    "braked_before": "measures.decision.braked_before_s",
    "bodies_least": "measures.decision.bodies_least",
    "in_sight": "measures.decision.in_sight",
}
"""Columns that an experiment needs beside those of the collision study, and what they are."""

SUFFIX: Final = "_decisions.csv"
"""The end of the name of the file of decisions, after the name of the experiment."""

THERE: Final = "there"
AGE: Final = "age"
BINS: Final[Mapping[str, tuple[float, ...]]] = {
    THERE: (0.0, 0.001, 0.25, 0.5, 0.75, 1.001),
    AGE: (0.0, 0.2, 0.5, 1.0, 1.2, 1.5, 2.0, math.inf),
}
"""Bounds of what is counted together: shares of scans (none, and four quarters), and ages [s]."""

Key = TypeVar("Key")


@dataclass(frozen=True, slots=True, kw_only=True)
class Decision:
    """What a run had at its point of no return; `None` where there was nothing to measure.

    Attributes:
        condition: under which it was made.
        seed: the seed of the run.
        collision: whether the ego collided; `None` if the run failed.
        no_return: the point of no return [s].
        there: share of the scans of the last second before it that were there, 0 to 1.
        age: age of the newest of all scans that were there [s].
        sent: messages that the sharing node had sent of the scans of that second.
        direct_there: share of these that the ego could decode itself, 0 to 1.
        known_before: how long before it the ego first knew of the hidden vehicle [s].
        seen_before: how long before it the ego's own sensor first saw that [s].
        braked_before: how long before it the ego had begun to brake [s].
        bodies_least: the least number of bodies in the direct link in that second.
        in_sight: share of that second in which the hidden vehicle was in the ego's sight, 0 to 1.
    """

    condition: Condition
    seed: int
    collision: bool | None
    no_return: float | None
    there: float | None
    age: float | None
    sent: int | None
    direct_there: float | None
    known_before: float | None
    seen_before: float | None
    braked_before: float | None
    bodies_least: int | None
    in_sight: float | None


@dataclass(frozen=True, slots=True, kw_only=True)
class Had:
    """What the runs under a condition had: a row of the table of the study.

    Attributes:
        experiment: the name of the experiment.
        policy, relay, compression, maximum_age, channel, per: what they are in the `Condition`.
        runs: those with a point of no return.
        collisions: the share of them with a collision.
        there: mean share of the scans of the last second that were there.
        age: mean age of the newest scan [s], over the runs to which one had come.
        nothing: share of the runs to which no scan had come in that second.
        known: share of the runs in which the ego knew of the hidden vehicle by then.
        known_before: mean time from the first knowledge to then [s], negative if it came later;
            over the runs in which it came at all.
        braked_before: mean time from the brakes to then [s], likewise.
        direct_there: mean share of the messages sent in that second that the ego could decode.
        bodies_least: the least number of bodies in the direct link, of all runs.
        in_sight: mean share of that second in which the ego had the other in sight.
    """

    experiment: str
    policy: str
    relay: str
    compression: int | None
    maximum_age: float | None
    channel: str
    per: float | None
    runs: int
    collisions: Estimate | None
    there: Estimate | None
    age: Estimate | None
    nothing: Estimate | None
    known: Estimate | None
    known_before: Estimate | None
    braked_before: Estimate | None
    direct_there: Estimate | None
    bodies_least: int | None
    in_sight: Estimate | None


@dataclass(frozen=True, slots=True, kw_only=True)
class Dose:
    """How many collide of the runs that had a certain share of the last second's scans, or news.

    Attributes:
        experiment: the name of the experiment.
        policy, compression, maximum_age, channel: what they are in the `Condition`.
        measure: `there`, that share, or `age`, the age of the newest scan [s], which has no end
            where none came.
        low, high: the bounds of it; `high` is not among it, unless it has no end.
        runs: how many had such a share, or age.
        collisions: the share of them with a collision.
    """

    experiment: str
    policy: str
    compression: int | None
    maximum_age: float | None
    channel: str
    measure: str
    low: float
    high: float
    runs: int
    collisions: Estimate | None


def decisions(results: Results, policy: str) -> list[Decision]:
    """What every run had.

    Args:
        results: what the experiment found.
        policy: the name of the driving policy if no factor is.
    """
    return [
        Decision(
            condition=condition, **{name: row[name] for name in ("seed", "collision", *METRICS)}
        )
        for condition, row in with_conditions(results, policy)
    ]


def read(folder: Path, experiments: Iterable[str]) -> dict[str, list[Decision]]:
    """What the reports of these experiments wrote to `folder`, of those that were run.

    Raises:
        ValueError: a file is not what a report wrote.
    """
    files = {name: folder / f"{name}{SUFFIX}" for name in experiments}
    return {n: records.read(path, Decision) for n, path in files.items() if path.is_file()}


def had(found: Mapping[str, Sequence[Decision]]) -> list[Had]:
    """What runs had under every condition of every experiment."""
    rows = []
    for experiment, every in found.items():
        for condition, own in _grouped(every, lambda one: one.condition).items():
            rows.append(_had(experiment, condition, own))
    return rows


def doses(found: Mapping[str, Sequence[Decision]]) -> list[Dose]:
    """How many collide with which share of the scans, and with how old ones, whatever lost any."""
    rows = []
    for experiment, every in found.items():
        groups = _grouped(every, lambda one: _who(one.condition))
        for (policy, compression, age, channel), own in groups.items():
            for measure, low, high in ((each, *pair) for each in BINS for pair in bounds(each)):
                hit = [bool(one.collision) for one in own if _is_in(one, measure, low, high)]
                rows.append(
                    Dose(
                        experiment=experiment,
                        policy=policy,
                        compression=compression,
                        maximum_age=age,
                        channel=channel,
                        measure=measure,
                        low=low,
                        high=high,
                        runs=len(hit),
                        collisions=share_of(hit),
                    )
                )
    return rows


def bounds(measure: str) -> list[tuple[float, float]]:
    """What is counted together: the bounds of every bin of `there`, or of `age`."""
    return list(pairwise(BINS[measure]))


def _is_in(one: Decision, measure: str, low: float, high: float) -> bool:
    """Whether a run with a point of no return had so much, or such news."""
    if one.there is None:
        return False
    age = math.inf if one.age is None else one.age
    value = one.there if measure == THERE else age
    return low <= value < high or value == high == math.inf


def _who(condition: Condition) -> tuple[str, int | None, float | None, str]:
    return condition.policy, condition.compression, condition.maximum_age, condition.channel


def _had(experiment: str, condition: Condition, every: Sequence[Decision]) -> Had:
    own = [one for one in every if one.there is not None]

    def mean(of: Callable[[Decision], float | None]) -> Estimate | None:
        return mean_of([value for value in map(of, own) if value is not None])

    bodies = [one.bodies_least for one in own if one.bodies_least is not None]
    return Had(
        **condition.repeated_in(Had),
        experiment=experiment,
        runs=len(own),
        collisions=share_of([bool(one.collision) for one in own]),
        there=mean(lambda one: one.there),
        age=mean(lambda one: one.age),
        nothing=share_of([one.there == 0.0 for one in own]),
        known=share_of([(one.known_before or -1.0) >= 0.0 for one in own]),
        known_before=mean(lambda one: one.known_before),
        braked_before=mean(lambda one: one.braked_before),
        direct_there=mean(lambda one: one.direct_there),
        bodies_least=min(bodies, default=None),
        in_sight=mean(lambda one: one.in_sight),
    )


def _grouped(
    found: Sequence[Decision], key: Callable[[Decision], Key]
) -> dict[Key, list[Decision]]:
    """Runs by something that they have in common, those that failed left out."""
    groups: dict[Key, list[Decision]] = {}
    for one in found:
        own = groups.setdefault(key(one), [])
        if one.collision is not None:
            own.append(one)
    return groups
