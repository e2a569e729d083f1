"""The table: intervals, success weighted by completion time, packet error rates."""

import math
from dataclasses import replace

import pytest
from hypothesis import given, strategies as st

from orchestrator.intervals import Estimate, share
from studies.collision.curves import assumptions
from studies.collision.runs import Point, Run
from studies.collision.statistics import (
    difference,
    expert_times,
    results,
    weighted_successes,
)
from studies.method import records
from tests.studies.bounds import known
from tests.studies.collision.synthetic import chance, condition, first, point

OUTCOMES = st.lists(
    st.tuples(st.booleans(), st.floats(5.0, 30.0), st.booleans(), st.floats(5.0, 30.0)),
    min_size=1,
    max_size=20,
)
"""By seed: success and time of a policy, success and time of the expert."""


def timed(policy: str, runs: list[tuple[bool, float]], *, speed: float = 30.0) -> Point:
    """Runs that succeed at a time, or do not."""
    found = {
        seed: Run(
            seed=seed,
            collision=not success,
            partner="",
            success=success,
            completion_time=time if success else None,
            per=0.0,
            begin=3.0,
            served=1.0,
        )
        for seed, (success, time) in enumerate(runs)
    }
    return Point("any", condition(policy=policy, compression=None, speed_kmh=speed), found)


@pytest.mark.parametrize(
    ("hits", "n", "low", "high"),
    [  # Wilson, JASA 22(158), 1927: (p + z^2/2n -+ z sqrt(p(1-p)/n + z^2/4n^2)) / (1 + z^2/n)
        (0, 400, 0.0, 0.009512),
        (0, 300, 0.0, 0.012643),  # 300 runs are too few for "less than 1 %"
        (0, 381, 0.0, 0.009982),
        (0, 380, 0.0, 0.010008),
        (150, 300, 0.4437, 0.5563),
    ],
)
def test_the_intervals_of_rates_are_those_of_wilson(
    hits: int, n: int, low: float, high: float
) -> None:
    (row,) = results([point(first(hits, n))])
    assert (row.runs, row.collisions) == (n, hits)
    assert row.rate == hits / n
    assert known(row.collision_rate).low == pytest.approx(low, abs=1e-4)
    assert known(row.collision_rate).high == pytest.approx(high, abs=1e-6 if hits == 0 else 1e-4)


@given(OUTCOMES)
def test_sct_is_what_its_definition_says_and_at_most_the_success_rate(
    outcomes: list[tuple[bool, float, bool, float]],
) -> None:
    policy = timed("blind", [(ok, time) for ok, time, *_ in outcomes])
    expert = timed("expert", [(ok, time) for *_, ok, time in outcomes])
    found = weighted_successes(policy, expert_times([policy, expert]))
    solved = [(ok, time, best) for ok, time, by_expert, best in outcomes if by_expert]
    assert found == [ok * best / max(time, best) if ok else 0.0 for ok, time, best in solved]
    assert math.fsum(found) <= sum(ok for ok, *_ in solved) + 1e-9


@given(OUTCOMES)
def test_the_expert_has_an_sct_of_one(outcomes: list[tuple[bool, float, bool, float]]) -> None:
    expert = timed("expert", [(ok, time) for *_, ok, time in outcomes])
    assert set(weighted_successes(expert, expert_times([expert]))) <= {1.0}


def test_a_speed_that_the_expert_did_not_drive_has_no_sct() -> None:
    expert, slow = timed("expert", [(True, 9.0)]), timed("blind", [(True, 12.0)], speed=25.0)
    _, row = results([expert, slow])
    assert (row.sct, row.sct_n) == (None, 0)


def test_the_packet_error_rate_is_the_one_set_or_the_mean_of_the_measured() -> None:
    runs = dict(point(first(0, 3)).runs)
    for seed, per in zip(runs, (0.2, 0.4, None), strict=True):
        runs[seed] = replace(runs[seed], per=per)
    simulated = Point("any", condition(channel="simulated", per=None), runs)
    constant = Point("any", condition(per=0.25), runs)
    assert [row.per for row in results([simulated, constant])] == [
        pytest.approx(0.3),
        0.25,
    ]
    measured, _ = results([simulated, constant])
    assert known(measured.packet_error_rate).high - 0.3 == pytest.approx(
        12.706 * 0.1, abs=1e-3
    )  # t, 1 degree


def test_the_first_columns_are_those_that_others_read() -> None:
    (row,) = results([point(first(0, 3))])
    names = ["policy", "relay", "compression", "speed_kmh", "per", "runs", "collisions"]
    assert list(records.rows([row])[0])[:10] == [*names, "rate", "low", "high"]


def test_a_condition_without_runs_has_a_row() -> None:
    (row,) = results([point([])])
    assert (row.runs, row.rate, row.success, row.sct) == (0, None, None, None)


@given(st.integers(0, 50), st.integers(0, 50))
def test_the_interval_of_a_difference_holds_it_and_turns_with_it(a: int, b: int) -> None:
    one, other = (share(first(hits, 50)) for hits in (a, b))
    there, back = known(difference(one, other)), difference(other, one)
    assert there.low - 1e-12 <= there.value <= there.high + 1e-12
    assert [back.low, back.high] == pytest.approx([-there.high, -there.low])


def test_the_difference_is_that_of_newcombe() -> None:
    """56/70 minus 48/80: 0.0524 to 0.3339 (Statistics in Medicine 17, 1998, table II)."""
    found = difference(share(first(56, 70)), share(first(48, 80)))
    assert found.value == pytest.approx(0.2)
    assert found.low == pytest.approx(0.0524, abs=1e-4)
    assert found.high == pytest.approx(0.3339, abs=1e-4)


def test_without_an_interval_a_difference_has_none() -> None:
    assert difference(Estimate(0.5, None, None), share([True])) == Estimate(-0.5, None, None)


def by_chance(per: float) -> Point:
    return point([chance(seed) < per for seed in range(200)], per=per)


def test_a_channel_of_the_assumed_kind_is_as_assumed() -> None:
    """The simulated channel collides at every packet error rate like the constant one."""
    constant = [by_chance(k / 10) for k in range(11)]
    measured = point([chance(seed) < 0.35 for seed in range(200)], channel="simulated", per=None)
    runs = {seed: replace(run, per=0.35) for seed, run in measured.runs.items()}
    (row,) = assumptions([*constant, replace(measured, runs=runs)])
    assert known(row.per).value == pytest.approx(0.35)
    assert known(row.assumed).value == pytest.approx(0.35, abs=0.01)
    assert known(row.difference).low < 0.0 < known(row.difference).high


def test_a_channel_of_another_kind_is_not() -> None:
    constant = [by_chance(k / 10) for k in range(11)]
    measured = point(first(180, 200), channel="simulated", per=None)
    runs = {seed: replace(run, per=0.35) for seed, run in measured.runs.items()}
    (row,) = assumptions([*constant, replace(measured, runs=runs)])
    assert known(row.difference).value == pytest.approx(0.55, abs=0.01)
    assert known(row.difference).low > 0.4


def test_a_rate_that_never_occurred_is_not_certain() -> None:
    constant = [point(first(0, 50), per=k / 10) for k in range(11)]
    measured = point(first(0, 50), channel="simulated", per=None)
    runs = {seed: replace(run, per=0.35) for seed, run in measured.runs.items()}
    (row,) = assumptions([*constant, replace(measured, runs=runs)])
    assert known(row.difference).value == 0.0
    assert known(row.difference).low < -0.05
    assert known(row.difference).high > 0.05


def test_what_was_never_sent_is_not_served_either() -> None:
    """Two of three runs got half of the messages, in one fusion was never triggered."""
    usual = point(first(0, 3))
    served = (0.5, 0.5, None)
    runs = {
        run.seed: replace(run, served=share)
        for run, share in zip(usual.runs.values(), served, strict=True)
    }
    (row,) = results([replace(usual, runs=runs)])
    assert known(row.unserved).value == pytest.approx((0.5 + 0.5 + 1.0) / 3)
    (blind,) = results([timed("blind", [(True, 10.0)])])
    assert blind.unserved is None
