"""Table II, regret, differences: against rates that we chose and arithmetic by hand."""

import math
from typing import Any

import pytest
from hypothesis import given, strategies as st

from orchestrator.intervals import student_t
from studies.relay import statistics
from studies.relay.conditions import vehicles_per_km
from studies.relay.runs import Study
from studies.relay.statistics import band, density_points, pairs, steps
from tests.studies.bounds import known
from tests.studies.relay.synthetic import experiment, run
from tests.studies.results import Levels, results

RATES = {
    "oracle": [0.9, 0.8, 1.0, 0.7],
    "mohed": [0.8, 0.8, 0.9, 0.5],
    "direct": [0.4, 0.2, 0.5, 0.1],
}
SWITCHES = {"oracle": [1, 2, 1, 2], "mohed": [3, 2, 3, 2], "direct": [0, 0, 0, 0]}
BASE = {"density": "30 m"}


def of_run(levels: Levels, seed: int) -> dict[str, object]:
    method = levels["method"]
    return run(RATES[method][seed - 1], switches=SWITCHES[method][seed - 1])


def study() -> Study:
    return Study(results(experiment(("mohed", "direct", "oracle")), of_run), BASE)


def half_width(values: list[float]) -> float:
    middle = sum(values) / len(values)
    variance = sum((value - middle) ** 2 for value in values) / (len(values) - 1)
    return student_t(len(values) - 1) * math.sqrt(variance / len(values))


def test_means_and_intervals_beside_the_numbers_of_the_paper() -> None:
    mohed, direct, oracle = statistics.results(study(), [BASE])
    half = half_width(RATES["mohed"])
    assert known(mohed.prr) == pytest.approx((0.75, 0.75 - half, 0.75 + half))
    assert known(mohed.relay_switches).value == pytest.approx(2.5)
    assert (mohed.n, mohed.runs) == (4, 4)
    assert (mohed.paper_prr, mohed.paper_relay_switches) == (0.8798, 2.75)
    assert (direct.paper_prr, direct.paper_relay_switches) == (0.3922, 0.0)
    assert (oracle.paper_prr, oracle.paper_relay_switches) == (None, None)
    assert known(mohed.collision_rate).value == 0.0
    assert known(mohed.collision_rate).high > 0.4  # Wilson, 0 of 4


def test_regret_is_paired_by_seed() -> None:
    """By hand: 0.1, 0.0, 0.1, 0.2; unpaired, the interval would be more than twice as wide."""
    mohed, direct, oracle = statistics.results(study(), [BASE])
    lost = [0.1, 0.0, 0.1, 0.2]
    regret = known(mohed.regret)
    assert regret.value == pytest.approx(0.1)
    assert regret.high - regret.value == pytest.approx(half_width(lost))
    unpaired = math.hypot(half_width(RATES["oracle"]), half_width(RATES["mohed"]))
    assert regret.high - regret.value < unpaired / 2
    assert known(direct.regret).value == pytest.approx(0.55)
    assert known(oracle.regret) == (0.0, 0.0, 0.0)


def test_only_seeds_that_both_have_are_compared() -> None:
    """Seed 2 of the oracle failed, in seed 4 nothing was sent with MoHeD."""

    def outcome(levels: Levels, seed: int) -> dict[str, object] | None:
        if (levels["method"], seed) == ("oracle", 2):
            return None
        if (levels["method"], seed) == ("mohed", 4):
            return run(None)
        return of_run(levels, seed)

    plan = experiment(("mohed", "oracle"))
    mohed, oracle = statistics.results(Study(results(plan, outcome), BASE), [BASE])
    assert (mohed.runs, mohed.n, mohed.regret_n) == (4, 3, 2)
    assert known(mohed.regret).value == pytest.approx(0.1)
    assert (oracle.runs, oracle.n) == (3, 3)
    (pair,) = pairs(Study(results(plan, outcome), BASE))
    assert pair.n == 2
    assert known(pair.difference).value == pytest.approx(-10.0)


def test_without_an_oracle_there_is_no_regret() -> None:
    (row,) = statistics.results(Study(results(experiment(("mohed",)), of_run), BASE), [BASE])
    assert (row.regret, row.regret_n) == (None, 0)


def test_before_the_first_run_all_rows_are_there_and_empty() -> None:
    nothing = results(experiment(("mohed", "oracle"), seeds=1), of_run, without=1)
    found = Study(nothing, BASE)
    assert [(row.n, row.prr) for row in statistics.results(found, [BASE])] == [(0, None), (0, None)]
    assert [row.difference for row in pairs(found)] == [None]
    assert [row.prr for row in density_points(found)] == [None, None]
    assert steps(found) == []


def test_differences_of_methods() -> None:
    first = pairs(study())[0]
    assert (first.a, first.b) == ("mohed", "direct")
    assert known(first.difference).value == pytest.approx(45.0)
    assert (first.a_better, first.b_better) == (1.0, 0.0)
    second = pairs(study())[1]
    assert (second.a, second.b) == ("mohed", "oracle")
    assert (second.a_better, second.b_better) == (0.0, 0.75)  # once they are equal


def test_the_density_is_that_of_the_scenario() -> None:
    """1000 / N vehicles per km and lane at a spacing of N metres, whatever the level is called."""
    plan = experiment(("mohed", "direct"), (20.0, 45.0))
    points = density_points(Study(results(plan, of_run), {"density": "20 m"}))
    assert [(p.method, round(p.vehicles_per_km, 3)) for p in points] == [
        ("mohed", 22.222),
        ("mohed", 50.0),
        ("direct", 22.222),
        ("direct", 50.0),
    ]


def test_a_scenario_without_traffic_has_no_density() -> None:
    scenario: dict[str, Any] = {"components": {"channel": {"parameters": {}}}}
    with pytest.raises(ValueError, match=r"0 components of .* a parameter `background\.spacing`"):
        vehicles_per_km(scenario)
    scenario["components"]["traffic"] = {"parameters": {"background": None}}
    with pytest.raises(ValueError, match=r"0 components of .* a parameter `background\.spacing`"):
        vehicles_per_km(scenario)


def test_every_condition_has_its_table() -> None:
    plan = experiment(("mohed", "direct"), (20.0, 45.0))
    made = Study(results(plan, of_run), {"density": "20 m"})
    found = statistics.results(made, made.conditions)
    assert [(row.method, row.condition["density"]) for row in found] == [
        ("mohed", "20 m"),
        ("direct", "20 m"),
        ("mohed", "45 m"),
        ("direct", "45 m"),
    ]


def test_the_distribution_function_has_steps_at_the_values() -> None:
    rows = [row for row in steps(study()) if row.method == "mohed"]
    assert [(row.prr, row.share) for row in rows] == [(0.5, 0.25), (0.8, 0.75), (0.9, 1.0)]
    epsilon = math.sqrt(math.log(40.0) / 8.0)
    assert rows[0].share_high == pytest.approx(0.25 + epsilon)
    assert rows[1].share_low == pytest.approx(0.75 - epsilon)
    assert (rows[0].share_low, rows[2].share_high) == (0.0, 1.0)


def test_the_band_at_fifty_runs_is_that_of_massart() -> None:
    assert band(50) == pytest.approx(0.19206, abs=1e-5)


@given(st.lists(st.floats(0.0, 1.0), min_size=1, max_size=30))
def test_a_distribution_function_rises_to_one_within_its_band(rates: list[float]) -> None:
    plan = experiment(("mohed",), seeds=len(rates))
    found = results(plan, lambda _, seed: run(rates[seed - 1]))
    rows = steps(Study(found, BASE))
    shares = [row.share for row in rows]
    assert shares == sorted(shares)
    assert shares[-1] == 1.0
    assert all(0.0 <= r.share_low <= r.share <= r.share_high <= 1.0 for r in rows)
