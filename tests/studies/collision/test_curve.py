"""The curve over the packet error rate: it rises, crosses levels, and is resampled by seeds."""

import itertools
import math
from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from studies.collision.curves import (
    LEVELS,
    critical_points,
    curve_of,
    curves,
    distinct,
    linearities,
    resampling_of,
)
from studies.collision.runs import Point
from studies.method.curve import Curve, interval
from tests.studies.bounds import known
from tests.studies.collision.synthetic import chance, first, point

SHARES = st.lists(st.integers(0, 12), min_size=2, max_size=6)
"""Collisions of 12 runs, by packet error rate."""


def over(hits: Sequence[int], n: int = 12) -> list[Point]:
    """A curve over equidistant rates from 0 to 1."""
    pers = np.linspace(0.0, 1.0, len(hits))
    return [point(first(k, n), per=float(per)) for k, per in zip(hits, pers, strict=True)]


def curve(hits: Sequence[int], n: int = 12, resamples: int = 20) -> Curve:
    points = over(hits, n)
    return curve_of(points, resampling_of(points, resamples))


def likelihood(hits: Sequence[int], rates: Sequence[float], n: int = 12) -> float:
    """The logarithm, -inf where the rates exclude what was counted."""
    total = 0.0
    for k, p in zip(hits, rates, strict=True):
        for count, share in ((k, p), (n - k, 1.0 - p)):
            if count:
                total += count * math.log(share) if share > 0.0 else -math.inf
    return total


def pool(hits: Sequence[int], n: int = 12) -> list[float]:
    """Adjacent violators, pooled one by one (Ayer et al., 1955)."""
    blocks: list[tuple[int, int]] = []
    for k in hits:
        blocks.append((k, n))
        while len(blocks) > 1 and blocks[-2][0] * blocks[-1][1] > blocks[-1][0] * blocks[-2][1]:
            (a, m), (b, o) = blocks[-2:]
            blocks[-2:] = [(a + b, m + o)]
    return [a / m for a, m in blocks for _ in range(m // n)]


@given(SHARES)
def test_the_rising_curve_pools_adjacent_violators(hits: list[int]) -> None:
    assert curve(hits).rising[0] == pytest.approx(pool(hits))


@given(SHARES)
def test_the_rising_curve_rises_in_every_resample_within_the_shares(hits: list[int]) -> None:
    found = curve(hits)
    assert (np.diff(found.rising, axis=1) >= -1e-12).all()
    assert (found.rising >= found.rate.min(axis=1, keepdims=True) - 1e-12).all()
    assert (found.rising <= found.rate.max(axis=1, keepdims=True) + 1e-12).all()


@given(st.lists(st.integers(0, 12), min_size=2, max_size=3))
@settings(max_examples=30)
def test_no_rising_curve_on_a_grid_is_likelier(hits: list[int]) -> None:
    best = likelihood(hits, curve(hits).rising[0].tolist())
    grid = [k / 24 for k in range(25)]
    rising = itertools.combinations_with_replacement(grid, len(hits))
    assert all(likelihood(hits, rates) <= best + 1e-9 for rates in rising)


@given(SHARES, st.floats(0.01, 0.99))
def test_a_crossing_has_the_level_and_splits_the_curve(hits: list[int], level: float) -> None:
    found = curve(hits)
    crossing, rates, per = found.crossing(level)[0], found.rising[0], found.position[0]
    if crossing == -math.inf:
        assert rates[0] >= level
    elif crossing == math.inf:
        assert rates[-1] < level
    else:
        assert np.interp(crossing, per, rates) == pytest.approx(level)
        assert (rates[per < crossing - 1e-12] < level).all()
        assert (rates[per > crossing + 1e-12] >= level - 1e-12).all()


def test_a_crossing_lies_on_the_straight_line_between_points() -> None:
    found = curve([0, 0, 30, 60, 90], n=100).crossing(0.1)[0]
    assert found == pytest.approx(0.25 + 0.25 * 0.1 / 0.3)


@given(SHARES)
def test_a_higher_level_is_not_crossed_earlier(hits: list[int]) -> None:
    found = curve(hits)
    crossings = [found.crossing(level)[0] for level in LEVELS]
    assert crossings == sorted(crossings)


def test_the_first_resample_is_what_was_measured() -> None:
    points = over([0, 3, 12])
    found = curve_of(points, resampling_of(points, 5))
    assert found.rate[0].tolist() == [0.0, 0.25, 1.0]
    assert found.position[0].tolist() == [0.0, 0.5, 1.0]
    assert (found.trials == 12).all()


def test_equal_seeds_are_drawn_together() -> None:
    """Two conditions with the same outcomes differ in no resample: common random numbers."""
    a, b = point(first(5, 20), per=0.1), point(first(5, 20), per=0.2)
    resampling = resampling_of([a, b], 200)
    rates = curve_of([a, b], resampling).rate
    assert (rates[:, 0] == rates[:, 1]).all()
    assert len(np.unique(rates)) > 2


def test_the_interval_of_a_share_is_about_that_of_the_normal_approximation() -> None:
    one = point(first(60, 200))
    found = known(interval(curve_of([one], resampling_of([one])).rate[:, 0]))
    half = 1.96 * math.sqrt(0.3 * 0.7 / 200)
    assert found.value == 0.3
    assert found.low == pytest.approx(0.3 - half, abs=0.01)
    assert found.high == pytest.approx(0.3 + half, abs=0.01)


def test_seeds_that_a_condition_lacks_do_not_count_in_it() -> None:
    short, long = point(first(2, 4), per=0.0), point(first(5, 20), per=1.0)
    found = curve_of([short, long], resampling_of([short, long], 50))
    assert found.rate[0].tolist() == [0.5, 0.25]
    assert np.isfinite(found.rising).all()


@pytest.mark.parametrize("hits", [0, 60])
def test_levels_that_are_not_crossed_are_infinitely_far(hits: int) -> None:
    rows = critical_points(over([hits] * 3, n=60))
    assert {None if row.per is None else row.per.value for row in rows} == {
        math.inf if hits == 0 else -math.inf
    }
    assert {(row.first, row.last) for row in rows} == {(0.0, 1.0)}


def test_the_critical_point_is_within_its_interval_and_that_shrinks_with_runs() -> None:
    widths = []
    for n in (40, 400):
        points = [
            point([chance(seed) < step for seed in range(n)], per=k / 10)
            for k, step in enumerate([0.0] * 4 + [0.05, 0.1, 0.3, 0.5, 0.6, 0.6, 0.6])
        ]
        (row,) = (row for row in critical_points(points) if row.level == 0.5)
        per = known(row.per)
        assert per.low <= per.value <= per.high
        assert per.value == pytest.approx(0.7, abs=0.05)
        widths.append(per.high - per.low)
    assert widths[1] < widths[0]


def straight(n: int = 300) -> list[Point]:
    return [
        point([chance(seed * 11 + k) < k / 10 for seed in range(n)], per=k / 10) for k in range(11)
    ]


def bent(n: int = 300) -> list[Point]:
    """Nothing happens up to 50 %, and then everything does."""
    return [point([k > 5] * n, per=k / 10) for k in range(11)]


def test_a_straight_line_is_straight_and_a_step_is_not() -> None:
    (line,), (step,) = linearities(straight()), linearities(bent())
    assert abs(line.deviation) < line.band
    assert line.p > 0.05
    assert line.deviance_line < line.deviance_logistic
    assert step.deviation == pytest.approx(-0.5)
    assert step.at == 0.5
    assert step.p < 0.001
    assert step.deviance_line > 100.0
    assert step.deviance_logistic == pytest.approx(0.0, abs=1e-3)
    assert step.freedom == 9


@pytest.mark.slow
def test_of_straight_curves_one_in_twenty_or_fewer_is_called_bent() -> None:
    rng = np.random.default_rng(3)
    called = 0
    for _ in range(60):
        draws = rng.random((6, 100))
        points = [point((draws[k] < 0.1 + 0.14 * k).tolist(), per=k / 5) for k in range(6)]
        (row,) = linearities(points)
        called += abs(row.deviation) > row.band
    assert called <= 8  # binomial(60, 0.05): more than 8 has a probability of 0.3 %


def test_curves_hold_points_of_one_compression_speed_and_channel() -> None:
    points = [
        *over([0, 6]),
        point(first(1, 12), per=0.0, compression=16),
        point(first(1, 12), per=0.5, policy="blind", compression=None),
        point(first(1, 12), per=0.7, load="full"),
        point(first(1, 12), per=0.8, relay="mohed"),  # two hops lose more than 80 %
    ]
    (found,) = curves(points).values()
    assert found == points[:2]


def test_a_condition_of_two_experiments_is_that_of_more_runs() -> None:
    short, long = point(first(1, 5), name="a"), point(first(1, 9), name="b")
    assert distinct([short, long]) == distinct([long, short]) == [long]
