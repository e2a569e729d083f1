"""Two relay methods in the same traffic: who collides, and what was there at the decision."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

from orchestrator.intervals import Estimate
from studies.collision.conditions import SIMULATED, Condition
from studies.collision.statistics import difference
from studies.lasting.decisions import Decision
from studies.lasting.scenes import SCENES
from studies.method.estimates import Sample, differences, mean_of, share_of


@dataclass(frozen=True, slots=True, kw_only=True)
class Pair:
    """A relay method minus another one, over the seeds of which both have a point of no return.

    Attributes:
        scene: the name of the scene.
        policy, compression: what they are in the `Condition`.
        first, second: the relay methods.
        runs: the number of these seeds.
        only_first, only_second: seeds in which only the one collides.
        collisions: difference of the collision rates, as if they were independent.
        there: difference of the shares of the last second's scans that were there, by seed.
        age: difference of the ages of the newest scans [s], by seed.
    """

    scene: str
    policy: str
    compression: int | None
    first: str
    second: str
    runs: int
    only_first: int
    only_second: int
    collisions: Estimate | None
    there: Estimate | None
    age: Estimate | None


def pairs(found: Mapping[str, Sequence[Decision]]) -> list[Pair]:
    """All pairs of relay methods over the simulated channel that differ in nothing else.

    Args:
        found: what the runs had, by the name of the experiment; those of a scene count together.
    """
    rows = []
    for scene in SCENES:
        every = [one for name in scene.files for one in found.get(name, ())]
        for group in _groups(every):
            for one, other in combinations(group, 2):
                rows.append(_pair(scene.name, one, other))
    return rows


def _groups(every: Iterable[Decision]) -> Iterator[list[list[Decision]]]:
    """The runs of every relay method, grouped by everything else."""
    groups: dict[Condition, dict[str, list[Decision]]] = {}
    for one in every:
        if one.condition.channel == SIMULATED and one.collision is not None:
            rest = replace(one.condition, relay="")
            groups.setdefault(rest, {}).setdefault(one.condition.relay, []).append(one)
    for methods in groups.values():
        yield list(methods.values())


def _pair(scene: str, one: Sequence[Decision], other: Sequence[Decision]) -> Pair:
    first = {run.seed: run for run in one if run.there is not None}
    second = {run.seed: run for run in other if run.there is not None}
    seeds = sorted(first.keys() & second.keys())
    collided = [(bool(first[seed].collision), bool(second[seed].collision)) for seed in seeds]
    rates = [share_of([both[k] for both in collided]) for k in (0, 1)]
    known = [rate for rate in rates if rate is not None]

    def by_seed(name: str) -> Estimate | None:
        samples: list[Sample] = [
            {seed: value for seed in seeds if (value := getattr(runs[seed], name)) is not None}
            for runs in (first, second)
        ]
        return mean_of(differences(*samples))

    condition = one[0].condition
    return Pair(
        scene=scene,
        policy=condition.policy,
        compression=condition.compression,
        first=condition.relay,
        second=other[0].condition.relay,
        runs=len(seeds),
        only_first=sum(mine and not theirs for mine, theirs in collided),
        only_second=sum(theirs and not mine for mine, theirs in collided),
        collisions=difference(*known) if known else None,
        there=by_seed("there"),
        age=by_seed("age"),
    )
