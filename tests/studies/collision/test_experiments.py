"""What the experiment files of the campaign promise."""

from pathlib import Path
from typing import Any

import pytest

from orchestrator.experiment import skip
from orchestrator.experiment.schema import ExperimentFile
from orchestrator.intervals import share
from orchestrator.scenario.document import Document
from studies.collision.conditions import policy_name
from studies.collision.runs import EXPERIMENTS, METRICS

FOLDER = Path(__file__).parents[3] / "studies" / "collision" / "experiments"


def read(name: str) -> ExperimentFile:
    return ExperimentFile.model_validate(Document.read(FOLDER / f"{name}.yaml").data)


def levels(name: str) -> list[Any]:
    """Of all combinations."""
    file = read(name)
    factors = {factor: list(each) for factor, each in file.factors.items()}
    return list(skip.combinations(factors, file.skip))


@pytest.mark.parametrize("name", EXPERIMENTS)
def test_it_measures_what_the_report_needs_with_enough_seeds_that_nobody_trained_with(
    name: str,
) -> None:
    file = read(name)
    assert file.metrics == METRICS
    assert file.report is not None
    assert file.report.type == "collision-study"
    assert len(file.seeds) >= 300
    assert min(file.seeds) > 100


@pytest.mark.parametrize("name", ["collision_policies", "collision_relay"])
def test_less_than_one_percent_can_come_out(name: str) -> None:
    high = share([False] * len(read(name).seeds)).high
    assert high is not None
    assert high < 0.01


def test_the_policies() -> None:
    found = [each["policy"] for each in levels("collision_policies")]
    assert found == [
        "expert",
        "blind-rule",
        "blind",
        "rule-based",
        "object-list",
        "early-fusion",
        "cooperative-16",
        "cooperative-32",
    ]
    for policy in found[:-2]:  # each has a name for readers
        assert policy_name(policy, None) != policy


@pytest.mark.parametrize("name", ["collision_constant_per", "collision_speed", "collision_memory"])
def test_the_constant_rates_are_those_that_their_names_say(name: str) -> None:
    factor = read(name).factors["per"]
    rates = {
        level: settings["components.channel.parameters.per"] for level, settings in factor.items()
    }
    assert rates == {level: pytest.approx(float(level.removesuffix(" %")) / 100) for level in rates}
    assert {0.0, 1.0} <= set(rates.values())
    assert {len(settings) for settings in factor.values()} == {1}


@pytest.mark.parametrize(
    ("name", "difference"),
    [
        (
            "collision_speed",
            {
                "components.traffic.parameters.entities.ego.speed": "25 km/h",
                "components.policy.parameters.cruise_speed": "25 km/h",
            },
        ),
        ("collision_memory", {"components.policy.parameters.maximum_age": "150 ms"}),
    ],
)
def test_another_speed_or_memory_differs_in_nothing_else(
    name: str, difference: dict[str, str]
) -> None:
    whole, file = read("collision_constant_per"), read(name)
    assert file.fixed == {**whole.fixed, **difference}
    assert file.seeds == whole.seeds
    assert file.factors.keys() == whole.factors.keys()
    rates, all_rates = file.factors["per"], whole.factors["per"]
    common = rates.keys() & all_rates.keys()
    assert {"0 %", "100 %"} < common
    assert all(rates[level] == all_rates[level] for level in common)


def test_the_relay_methods_compressions_and_speeds_of_the_paper() -> None:
    assert len(levels("collision_relay")) == 4 * 2 * 2


def test_full_load_has_a_single_packet_to_be_compared_with() -> None:
    file = read("collision_load")
    assert file.fixed["components.facilities.parameters.load"] == "full"
    assert len(levels("collision_load")) == 2 * 3
    whole = read("collision_relay")
    assert whole.fixed["components.facilities.parameters.load"] == "probe"
    assert set(file.factors["method"]) < set(whole.factors["method"])
    assert set(file.seeds) < set(whole.seeds)
    compression = whole.factors["compression"]["32"]
    assert all(file.fixed[name] == value for name, value in compression.items())


def test_weaker_radios_differ_in_nothing_else() -> None:
    file, whole = read("collision_radio"), read("collision_relay")
    compression, speed = whole.factors["compression"]["32"], whole.factors["speed"]["30 km/h"]
    assert file.fixed == {**whole.fixed, **compression, **speed}
    for name, settings in file.factors["method"].items():
        assert whole.factors["method"][name] == settings
    assert set(file.seeds) < set(whole.seeds)
    for name, settings in file.factors["power"].items():
        assert settings == {"components.channel.parameters.transmit_power": name}


def test_a_policy_that_forgets_differs_in_nothing_else_over_the_simulated_channel() -> None:
    """An experiment beside the campaign: 60 seeds, for its analysis."""
    file, whole = read("collision_memory_direct"), read("collision_relay")
    compression, speed = whole.factors["compression"]["32"], whole.factors["speed"]["30 km/h"]
    forgets = {"components.policy.parameters.maximum_age": "150 ms"}
    assert file.fixed == {**whole.fixed, **compression, **speed, **forgets}
    assert file.factors["method"].items() <= whole.factors["method"].items()
    assert set(file.seeds) < set(whole.seeds)
    assert file.metrics == METRICS
