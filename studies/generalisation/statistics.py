"""The table of the study: collisions, successes and times of every policy in every variation."""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

from orchestrator.intervals import Estimate
from studies.generalisation.runs import Run
from studies.method.estimates import mean_of, share_of

EXPERT: Final = "expert"
"""The policy whose times count as those that are possible."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Result:
    """What the runs of a policy in a variation say.

    Attributes:
        encounter: the encounter, as `runs.ENCOUNTERS` calls it.
        variation: how it differs.
        policy: who drives.
        trained: whether it is a network that was trained in such scenes.
        runs: the number of runs that did not fail.
        collisions: of them, those with a collision.
        rate: their share, with the interval of Wilson.
        success: the share of runs in which the ego completed its way without a collision.
        sct: success weighted by completion time, over the seeds that the expert solved; none
            without any.
        sct_n: the number of these seeds.
        least_gap_m: the smallest distance to the danger in all runs [m].
        partners: with whom the ego collided and how often, as text.
    """

    encounter: str
    variation: str
    policy: str
    trained: bool
    runs: int
    collisions: int
    rate: Estimate | None
    success: Estimate | None
    sct: Estimate | None
    sct_n: int
    least_gap_m: float | None
    partners: str


def results(encounter: str, runs: Sequence[Run]) -> list[Result]:
    """One row per variation and policy, in the order in which they come.

    Args:
        encounter: of all these runs.
        runs: failed ones are left out.
    """
    done = [run for run in runs if run.error is None]
    times = {
        (run.variation, run.seed): run.completion_time
        for run in done
        if run.policy == EXPERT and run.success and run.completion_time is not None
    }
    groups = {(run.variation, run.policy): run.trained for run in runs}
    order = list(dict.fromkeys(variation for variation, _ in groups))
    return [
        _result(encounter, group, trained, done, times)
        for group, trained in sorted(groups.items(), key=lambda item: order.index(item[0][0]))
    ]


def _result(
    encounter: str,
    group: tuple[str, str],
    trained: bool,  # noqa: FBT001 - goes on as it is
    done: Sequence[Run],
    times: Mapping[tuple[str, int], float],
) -> Result:
    variation, policy = group
    own = [run for run in done if (run.variation, run.policy) == group]
    sct = list(weighted_successes(own, times))
    gaps = [run.min_gap_m for run in own if run.min_gap_m is not None]
    met = Counter(run.collision_partner or "unknown" for run in own if run.collision)
    return Result(
        encounter=encounter,
        variation=variation,
        policy=policy,
        trained=trained,
        runs=len(own),
        collisions=sum(bool(run.collision) for run in own),
        rate=share_of([bool(run.collision) for run in own]),
        success=share_of([bool(run.success) for run in own]),
        sct=mean_of(sct),
        sct_n=len(sct),
        least_gap_m=min(gaps, default=None),
        partners=", ".join(f"{name} {met[name]}" for name in sorted(met)),
    )


def weighted_successes(
    runs: Sequence[Run], times: Mapping[tuple[str, int], float]
) -> Iterator[float]:
    r"""What every seed that the expert solved adds to the success weighted by completion time.

    $$ \mathrm{SCT} = \overline{s \, T_e / \max(T, T_e)} $$

    as `studies.collision.statistics.weighted_successes` has it.

    Args:
        runs: of one policy in one variation.
        times: of the expert [s], by variation and seed, where it succeeded.
    """
    for run in runs:
        expert = times.get((run.variation, run.seed))
        if expert is None:
            continue
        is_through = run.success and run.completion_time is not None
        yield expert / max(run.completion_time or expert, expert) if is_through else 0.0
