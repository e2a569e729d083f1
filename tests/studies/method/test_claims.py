"""Verdicts: the rule at its boundaries."""

import pytest
from hypothesis import given, strategies as st

from orchestrator.intervals import Estimate
from studies.method.claims import Part, Range, Verdict, verdict

HOLDS, FAILS, OPEN = Part.HOLDS, Part.FAILS, Part.OPEN


@pytest.mark.parametrize(
    ("wanted", "low", "high", "expected"),
    [
        (Range(low=25.0), 25.0, 30.0, HOLDS),  # "at least": the bound satisfies it
        (Range(low=25.0), 24.9, 30.0, OPEN),
        (Range(low=25.0), 20.0, 25.0, OPEN),  # the upper end satisfies it
        (Range(low=25.0), 20.0, 24.9, FAILS),
        (Range(low=0.0, is_open=True), 0.0, 1.0, OPEN),  # "more than": it does not
        (Range(low=0.0, is_open=True), 0.1, 1.0, HOLDS),
        (Range(low=0.0, is_open=True), -1.0, 0.0, FAILS),
        (Range(high=0.0, is_open=True), 0.0, 0.0, FAILS),  # equal is not less
        (Range(high=0.0), 0.0, 0.0, HOLDS),
        (Range(high=3.0), 2.0, 3.0, HOLDS),
        (Range(high=3.0), 3.1, 4.0, FAILS),
        (Range(low=58.78, high=62.78), 59.0, 62.0, HOLDS),
        (Range(low=58.78, high=62.78), 50.0, 70.0, OPEN),
        (Range(low=58.78, high=62.78), 50.0, 58.0, FAILS),
        (Range(low=58.78, high=62.78), 63.0, 70.0, FAILS),
    ],
)
def test_an_interval_holds_fails_or_is_open(
    wanted: Range, low: float, high: float, expected: Part
) -> None:
    assert wanted.judge(Estimate((low + high) / 2, low, high)) is expected


def test_a_single_run_or_none_decides_nothing() -> None:
    assert Range(low=0.0).judge(Estimate(5.0, None, None)) is OPEN
    assert Range(low=0.0).judge(None) is OPEN


RANGES = st.builds(
    lambda low, width, is_open: Range(low=low, high=low + width, is_open=is_open),
    st.integers(-10, 10),
    st.integers(0, 10),
    st.booleans(),
)


@given(RANGES, st.integers(-10, 10), st.integers(0, 10))
def test_the_rule_is_that_all_values_of_the_interval_agree(
    wanted: Range, start: int, length: int
) -> None:
    found = Estimate(start + length / 2, start, start + length)
    inside = [wanted.has(start + length * k / 20) for k in range(21)]
    match wanted.judge(found):
        case Part.HOLDS:
            assert all(inside)
        case Part.FAILS:
            assert not any(inside)
        case Part.OPEN:
            assert not (wanted.has(found.low or 0.0) and wanted.has(found.high or 0.0))


@pytest.mark.parametrize(
    ("parts", "expected"),
    [
        ([HOLDS], Verdict.REPRODUCED),
        ([FAILS], Verdict.REFUTED),
        ([OPEN], Verdict.UNDECIDED),
        ([HOLDS, HOLDS], Verdict.REPRODUCED),
        ([HOLDS, OPEN], Verdict.PARTLY),
        ([FAILS, HOLDS], Verdict.PARTLY),
        ([OPEN, FAILS], Verdict.REFUTED),
        ([OPEN, OPEN], Verdict.UNDECIDED),
    ],
)
def test_a_claim_needs_all_its_comparisons(parts: list[Part], expected: Verdict) -> None:
    assert verdict(parts) is expected
