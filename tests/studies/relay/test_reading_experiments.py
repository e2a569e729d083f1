"""The experiments of the readings: what they run is what the page asks for, and it can be run."""

from functools import cache
from pathlib import Path

import pytest

from orchestrator.experiment.load import load_experiment
from orchestrator.experiment.plan import Experiment
from orchestrator.run import run_scenario
from orchestrator.scenario.build import load_scenario
from studies.relay.ahead import Place, places
from studies.relay.maps_page import MAPS
from studies.relay.reading_table import AHEAD, BASE, BUDGET, FORESIGHT, POLICIES, READINGS, SCENES
from studies.relay.readings_page import EXPERIMENTS

FOLDER = Path(__file__).parents[3] / "studies" / "relay" / "experiments"
FILES = {
    BASE: "paper_relay",
    POLICIES: "relay_readings",
    SCENES: "relay_scenes",
    BUDGET: "relay_map_budget",
    AHEAD: "relay_ahead",
    FORESIGHT: "relay_trajectories",
}


@cache
def experiment(name: str) -> Experiment:
    return load_experiment(FOLDER / f"{name}.yaml")


@pytest.mark.slow
@pytest.mark.parametrize("reading", READINGS, ids=lambda one: f"{one.name}, {one.rule}")
def test_every_method_of_a_reading_is_run_once(reading: object) -> None:
    for role in ("mohed", "strength", "random", "direct"):
        where = getattr(reading, role)
        combinations = experiment(FILES[where.table]).combinations
        assert sum(where.levels.items() <= one.levels.items() for one in combinations) == 1


@pytest.mark.slow
@pytest.mark.parametrize("place", [*places()], ids=lambda one: one.name)
def test_every_method_beside_trajectories_is_run_once(place: Place) -> None:
    for where in (place.ahead, place.mohed, place.total, place.own):
        combinations = experiment(FILES[where.table]).combinations
        assert sum(where.levels.items() <= one.levels.items() for one in combinations) == 1


@pytest.mark.slow
def test_all_meet_the_seeds_of_the_study() -> None:
    (seeds,) = {experiment(name).seeds for name in ("paper_relay", *EXPERIMENTS)}
    assert (seeds[0], seeds[-1], len(seeds)) == (101, 150, 50)


@pytest.mark.slow
@pytest.mark.parametrize("name", MAPS)
def test_a_map_has_four_by_four_cells_with_two_methods(name: str) -> None:
    found = experiment(name)
    methods = ("mohed", "signal-strength-own")
    assert [len(levels) for levels in found.levels.values()] == [4, 4, 2]
    assert found.levels["method"] == methods
    assert len(found.combinations) == 32


def test_a_scene_of_the_readings_is_the_cell_of_the_map() -> None:
    """Scenario by scenario, but for the relay: both tables are read side by side."""

    def scene(name: str, **levels: str) -> object:
        wanted = {key.replace("__", "-"): level for key, level in levels.items()}
        (found,) = [
            one.resolved
            for one in experiment(name).combinations
            if wanted.items() <= one.levels.items()
        ]
        components = {key: part for key, part in found["components"].items() if key != "relay"}
        return components, found["time"]

    pairs = {"30 % tall": ("30 %", "2"), "exponent 2.75": ("13 %", "2.75")}
    pairs |= {"exponent 3": ("13 %", "3"), "30 % tall, exponent 2.75": ("30 %", "2.75")}
    for name, (tall, exponent) in pairs.items():
        cell = {"tall_vehicles": tall, "path__loss_exponent": exponent, "method": "mohed"}
        one = scene("relay_scenes", scene=name, method="random")
        assert one == scene("relay_map_budget", **cell), name
        assert one == scene("relay_ahead", scene=name), name


@pytest.mark.parametrize("name", EXPERIMENTS)
def test_its_last_combination_runs(name: str, tmp_path: Path) -> None:
    """For two scans, which is before any choice; that choices differ is tested elsewhere."""
    found = experiment(name)
    overrides = (*found.combinations[-1].overrides, "seed=101", "time.stop=0.2 s")
    outcome = run_scenario(load_scenario(found.scenario, overrides), tmp_path / "run", figure=False)
    assert outcome.simulated == pytest.approx(0.2)
    assert {"prr", "relay_switches"} <= outcome.metrics.keys()
