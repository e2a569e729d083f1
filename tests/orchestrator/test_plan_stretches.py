"""How many points the engine works through at once."""

import pytest

from orchestrator.plan.plan import RunPlan

MS = 1_000_000  # [ns]


def adapted(most: int, spent: int, points: int, limit: int = 1 << 16) -> int:
    """What the next stretch may have, after one of `points` that took `spent` [ns]."""
    plan = RunPlan.__new__(RunPlan)
    plan._most, plan._limit = most, limit
    plan._adapt(spent, points)
    return plan._most


@pytest.mark.parametrize(
    ("most", "spent", "points", "then"),
    [
        (64, 0, 64, 4096),  # sixty-four times as many at most
        (64, 2 * MS, 64, 320),  # ten milliseconds
        (1024, 7 * MS, 1024, 1462),
        (1024, 9 * MS, 1024, 1024),  # nearly there: memory is kept
        (1024, 8 * MS, 1024, 1024),
        (1024, 7_800_000, 1024, 1312),
        (1024, 19 * MS, 1024, 1024),
        (1024, 21 * MS, 1024, 512),  # a request to stop would wait too long
        (1, 80 * MS, 1, 1),
        (1024, MS, 700, 1024),  # it ended early
        (1 << 15, MS, 1 << 15, 1 << 16),
    ],
)
def test_a_stretch_takes_about_ten_milliseconds(
    most: int, spent: int, points: int, then: int
) -> None:
    assert adapted(most, spent, points) == then


@pytest.mark.parametrize("cost", [100, 3_000, 150_000, 3 * MS, 40 * MS])
def test_stretches_settle_whatever_a_point_costs(cost: int) -> None:
    """Within a few stretches, at between eight and twenty milliseconds, or one point."""
    most, seen = 64, []
    for _ in range(12):
        seen.append(most)
        most = adapted(most, most * cost, most)
    assert seen[-1] == seen[-2]
    assert most == 1 or 8 * MS <= most * cost <= 20 * MS or most == 1 << 16
