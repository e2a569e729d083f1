"""Verdicts: the rule at its boundaries, and the claims on runs that we chose."""

from collections.abc import Callable, Mapping

import pytest
from hypothesis import given, strategies as st

from orchestrator.intervals import Estimate
from studies.method.verdict import Part, Range, Verdict, verdict
from studies.relay import claims
from studies.relay.sample import Study
from tests.studies.relay.synthetic import experiment, results, run

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


Rate = Callable[[int], Mapping[str, object]]


def verdicts(runs: Mapping[str, Rate]) -> dict[str, str]:
    """Of every claim."""
    plan = experiment(tuple(runs), seeds=4)
    found = results(plan, lambda levels, seed: runs[levels["method"]](seed))
    rows = claims.rows(Study(found, {"density": "30 m"}))
    return {row["claim"]: row["verdict"] for row in rows}


def constant(prr: float, switches: int) -> Rate:
    """The same in every run."""
    return lambda _: run(prr, switches=switches)


def test_the_numbers_of_the_paper_reproduce_its_claims() -> None:
    found = verdicts(
        {
            "mohed": constant(0.88, 2),
            "signal-strength": constant(0.47, 3),
            "random": constant(0.51, 4),
            "direct": lambda seed: run(0.39, direct=0.392 + 0.001 * (seed % 2)),
            "expected-prr": constant(0.90, 1),
            "oracle": constant(0.92, 1),
        }
    )
    assert set(found.values()) == {"reproduced"}


def test_the_opposite_refutes_them() -> None:
    found = verdicts(
        {
            "mohed": constant(0.40, 4),
            "signal-strength": constant(0.60, 3),
            "random": constant(0.50, 3),
            "direct": lambda _: run(0.8, direct=0.8),
            "expected-prr": constant(0.60, 1),
            "oracle": constant(0.92, 1),
        }
    )
    assert set(found.values()) == {"not reproduced"}


def test_better_than_one_rival_is_a_part_of_the_claim() -> None:
    found = verdicts(
        {
            "mohed": constant(0.80, 2),
            "signal-strength": constant(0.70, 2),
            "random": constant(0.50, 3),
        }
    )
    assert found["mohed-better"] == "reproduced"
    assert found["mohed-25-points"] == "partly reproduced"
    assert found["mohed-fewer-switches"] == "partly reproduced"  # equal is not fewer
    assert found["signal-strength-not-better"] == "not reproduced"
    assert found["direct-link"] == found["improved-near-oracle"] == "undecided"  # were not run


def test_differences_decide_where_rates_vary_with_the_traffic() -> None:
    """The rates spread over 40 points, and every difference is about 26."""
    found = verdicts(
        {
            "mohed": lambda seed: run(0.3 + 0.1 * seed + 0.26 + 0.001 * (seed % 2)),
            "signal-strength": constant(0.0, 0),
            "random": lambda seed: run(0.3 + 0.1 * seed),
        }
    )
    assert found["mohed-25-points"] == "reproduced"


def test_the_paper_stands_beside_every_comparison_that_it_has() -> None:
    plan = experiment(("mohed", "signal-strength", "random"))
    rows = claims.rows(Study(results(plan, lambda *_: run(0.5)), {"density": "30 m"}))
    paper = {row["quantity"]: row["paper"] for row in rows}
    assert paper["PRR of mohed minus signal-strength"] == pytest.approx(41.39)
    assert paper["relay switches of mohed minus random"] == pytest.approx(-0.9)
    assert paper["PER of the direct link"] == pytest.approx(60.78)
    assert paper["PRR of oracle minus expected-prr"] is None
