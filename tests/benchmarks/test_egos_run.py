"""The benchmark of several egos: who takes part, and what is made of the measurements."""

import pytest

from benchmarks.benchmark import Measurement
from benchmarks.egos import EgosBenchmark
from benchmarks.egos.benchmark import SCENARIO, EgosRun, settings
from orchestrator.scenario.build import load_scenario


@pytest.mark.parametrize("count", [1, 2, 10])
def test_as_many_egos_take_part_as_the_case_says(count: int) -> None:
    components = load_scenario(SCENARIO, settings(count)).components
    units = [name for name in components if name.startswith("policy-")]
    entities = components["traffic"].values["entities"]
    driven = [name for name, entity in entities.items() if entity is not None and entity.is_driven]
    assert len(units) == count
    assert {f"policy-{name}" for name in driven} == set(units)


@pytest.mark.slow
def test_a_run_costs_time() -> None:
    found = EgosRun(count=1).measure()
    assert 0.0 < found["cpu_s"] < 60.0


def test_rows_compare_with_as_many_runs_of_one_ego() -> None:
    measured: dict[str, list[Measurement]] = {
        "1 ego": [{"cpu_s": each} for each in (0.1, 0.2, 0.9)],
        "5 egos": [{"cpu_s": each} for each in (0.3, 0.6, 0.8)],
    }
    one, five = EgosBenchmark().rows(measured)
    assert (one.case, one.ours, one.peer, one.ratio) == ("1 ego", 0.2, 0.2, 1.0)
    assert (five.ours, five.low, five.high) == (0.6, 0.3, 0.8)
    assert five.peer == pytest.approx(1.0)
    assert five.ratio == pytest.approx(1.0 / 0.6)
    assert five.details["each_further_s"] == pytest.approx(0.1)


def test_without_the_run_of_one_ego_there_is_no_peer() -> None:
    (five,) = EgosBenchmark().rows({"5 egos": [{"cpu_s": 0.6}]})
    assert five.ratio is None
