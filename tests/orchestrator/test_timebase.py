"""Communication points are exact."""

import functools
import operator
from math import lcm

import pytest
from hypothesis import given, strategies as st

from orchestrator.timebase import CommunicationGrid, MultiRateGrid, nanoseconds, seconds

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
        with pytest.raises(ValueError, match=f"of {step} ns: {rest} ns are left over"):
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
