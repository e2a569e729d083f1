"""Communication points are exact."""

import functools
import operator
from fractions import Fraction
from math import lcm

import pytest
from hypothesis import given, strategies as st

from orchestrator.timebase import (
    CommunicationGrid,
    MultiRateGrid,
    as_step_size,
    common,
    format_duration,
    nanoseconds,
    seconds,
)

durations = st.integers(1, 10**9)


@given(step=durations, count=st.integers(0, 1000), start=st.integers(-(10**15), 10**15))
def test_the_last_point_is_start_plus_count_steps(step: int, count: int, start: int) -> None:
    grid = CommunicationGrid.over(start, start + count * step, step)
    assert [*grid, start + count * step] == [start + k * step for k in range(count + 1)]


@given(step=durations, count=st.integers(0, 1000), rest=st.integers(1, 10**9))
def test_an_interval_that_is_not_a_whole_number_of_steps_is_refused(
    step: int, count: int, rest: int
) -> None:
    rest %= step
    if rest:
        with pytest.raises(
            ValueError, match=f"of {format_duration(step)}: {format_duration(rest)} are left over"
        ):
            CommunicationGrid.over(0, count * step + rest, step)


def test_ten_thousand_tenths_of_a_second_are_a_thousand_seconds() -> None:
    """Accumulated floats miss it."""
    assert seconds(10_000 * nanoseconds("0.1")) == 1000.0
    assert (
        functools.reduce(operator.add, [0.1] * 10_000) != 1000.0
    )  # `sum` compensates from 3.12 on


@given(time=st.integers(-(10**15), 10**15))
def test_seconds_are_read_back_exactly(time: int) -> None:
    whole, rest = divmod(abs(time), 10**9)
    assert nanoseconds(f"{'-' if time < 0 else ''}{whole}.{rest:09}") == time


@pytest.mark.parametrize("text", ["1e-10", "0.0000000001", "1/3"])
def test_fractions_of_a_nanosecond_are_refused(text: str) -> None:
    with pytest.raises(ValueError, match="is not a whole number of nanoseconds"):
        nanoseconds(text)


def test_a_step_size_must_be_positive_and_time_must_run_forwards() -> None:
    with pytest.raises(ValueError, match="must be positive, got 0 ns"):
        CommunicationGrid.over(0, 10, 0)
    with pytest.raises(ValueError, match="ends at 5 ns, before it starts at 10 ns"):
        CommunicationGrid.over(10, 5, 1)


@given(
    step_sizes=st.lists(st.integers(1, 12), min_size=1, max_size=4, unique=True),
    start=st.integers(-100, 100),
    periods=st.integers(0, 3),
)
def test_a_multi_rate_grid_is_the_union_of_its_grids(
    step_sizes: list[int], start: int, periods: int
) -> None:
    stop = start + periods * lcm(*step_sizes)
    met = dict(MultiRateGrid(start, stop, tuple(step_sizes)))
    expected = {t: {h for h in step_sizes if (t - start) % h == 0} for t in range(start, stop + 1)}
    assert {t: set(h) for t, h in met.items()} == {t: h for t, h in expected.items() if h}
    assert list(met) == sorted(met)


def test_points_that_no_step_size_meets_cost_nothing() -> None:
    """1 s and 1 s + 1 ns have a greatest common divisor of 1 ns."""
    pair = (1_000_000_000, 1_000_000_001)
    with pytest.raises(ValueError, match="left over"):
        MultiRateGrid(0, 2_000_000_000, pair)
    span = pair[0] * pair[1]
    grid = iter(MultiRateGrid(0, span, pair))
    assert [next(grid)[0] for _ in range(4)] == [0, pair[0], pair[1], 2 * pair[0]]


fractions = st.fractions(min_value=1, max_value=10**9, max_denominator=1000).map(as_step_size)


@given(step=fractions, start=st.integers(-(10**12), 10**12), k=st.integers(0, 10**6))
def test_points_of_fractions_are_the_nanoseconds_nearest_to_them(
    step: int | Fraction, start: int, k: int
) -> None:
    grid = CommunicationGrid(start, step, 10**6)
    t = grid.at(k)
    assert abs(t - (start + k * Fraction(step))) <= Fraction(1, 2)
    assert grid.number(t) == grid.last(t) == k
    assert grid.last(t - 1) == k - 1
    assert grid.before(grid.after(t)) == t == grid.after(grid.before(t))
    assert grid.number(t + 1) == (k + 1 if grid.at(k + 1) == t + 1 else None)
    assert grid.seconds(t) == float((start + k * Fraction(step)) / 10**9)
    assert grid.length(t, grid.after(t) - t) == float(Fraction(step) / 10**9)
    assert grid.length(grid.before(t), grid.after(t) - grid.before(t)) == float(
        2 * Fraction(step) / 10**9
    )


def test_sixtieths_thirtieths_and_tenths_of_a_second_meet() -> None:
    second = 10**9
    sizes = Fraction(second, 60), Fraction(second, 30), second // 10
    met = dict(MultiRateGrid(0, second, sizes))
    assert len(met) == 61  # 60 points and the start: nobody else brings one of its own
    assert sum(len(each) == 3 for each in met.values()) == 11
    assert [t for t, who in met.items() if who == sizes[:1]][:2] == [16_666_667, 50_000_000]
    assert list(met)[-1] == second
    assert CommunicationGrid.over(0, second, sizes[0]).count == 60
    assert CommunicationGrid.over(0, second, sizes[0]).stop == second


def test_fractions_that_do_not_divide_a_span_or_are_too_short_are_refused() -> None:
    with pytest.raises(ValueError, match="of 1/60 s: 1/75 s are left over"):
        CommunicationGrid.over(0, 30_000_000, Fraction(50_000_000, 3))
    with pytest.raises(ValueError, match="must be 1 ns at least, got 1/2 ns"):
        CommunicationGrid(0, Fraction(1, 2), 1)


@given(a=fractions, b=fractions)
def test_both_are_multiples_of_what_they_have_in_common(
    a: int | Fraction, b: int | Fraction
) -> None:
    shared = common(a, b)
    first, second = Fraction(a) / shared, Fraction(b) / shared
    assert first.denominator == second.denominator == 1
    assert lcm(int(first), int(second)) == int(first) * int(second)


@pytest.mark.parametrize(
    ("size", "text"),
    [(Fraction(10**9, 60), "1/60 s"), (50_000_000, "50 ms"), (Fraction(2 * 10**9, 3), "2/3 s")],
)
def test_a_step_size_reads_as_it_is_written(size: int | Fraction, text: str) -> None:
    assert format_duration(size) == text
