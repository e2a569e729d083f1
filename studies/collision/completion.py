"""Success weighted by completion time."""

from collections.abc import Iterable, Mapping

from studies.collision.condition import EXPERT
from studies.collision.runs import Point, Run

Times = Mapping[tuple[float, int], float]
"""When the expert had completed its way [s], by speed [km/h] and seed; where it succeeded."""


def expert_times(points: Iterable[Point]) -> Times:
    """Of all runs of the expert that succeeded."""
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
    found = [(run, times.get((point.condition.speed_kmh, run.seed))) for run in _ordered(point)]
    return [_weighted(run, expert) for run, expert in found if expert is not None]


def _weighted(run: Run, expert: float) -> float:
    if not run.success or run.completion_time is None:
        return 0.0
    return expert / max(run.completion_time, expert)


def _ordered(point: Point) -> list[Run]:
    return [point.runs[seed] for seed in sorted(point.runs)]
