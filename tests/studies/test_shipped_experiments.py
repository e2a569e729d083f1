"""Every experiment and recipe that ships is valid, with all its combinations and scenes."""

from pathlib import Path

import pytest

import studies
from orchestrator.experiment.load import load_experiment
from orchestrator.scenario.extension import read
from studies.training.learning.bev import BevParameters
from studies.training.load import load_training
from studies.training.schema import TrainingFile

FILES = sorted(Path(studies.__file__).parent.glob("*/experiments/*.yaml"))
RECIPES = sorted(Path(studies.__file__).parent.glob("*/recipes/*.yaml"))
WHOLE = [
    path for path in RECIPES if not path.stem.startswith("general_") or path.stem == "general_32"
]
"""Those that extend no other one: their scenes are read, which takes seconds."""


@pytest.mark.slow
@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_it_is_valid(path: Path) -> None:
    assert load_experiment(path).runs()


@pytest.mark.slow
@pytest.mark.parametrize("path", WHOLE, ids=lambda path: path.stem)
def test_a_recipe_is_valid(path: Path) -> None:
    assert all(each.scenes for each in load_training(path).encounters)


@pytest.mark.parametrize(
    ("first", "name", "differs"),
    [
        ("general_32", "general_16", {"network", "checkpoint"}),
        ("general_32", "general_blind", {"network", "checkpoint"}),
        ("general_32", "general_early_fusion", {"network", "checkpoint"}),
        ("general_32", "general_32_one_side", {"network", "checkpoint", "encounters", "expert"}),
        ("overtaking_32", "overtaking_16", {"network", "checkpoint"}),
        ("overtaking_32", "overtaking_blind", {"network", "checkpoint"}),
    ],
)
def test_networks_are_trained_alike(first: str, name: str, differs: set[str]) -> None:
    """Equal scenes, rounds and runs of the expert: what differs is the network."""
    folder = RECIPES[0].parent
    whole, other = (read(folder / f"{stem}.yaml").data for stem in (first, name))
    assert {key for key in whole if whole[key] != other[key]} == differs
    TrainingFile.model_validate(other)
    parameters = {key: value for key, value in other["network"].items() if key != "type"}
    shape = BevParameters(**parameters).architecture
    assert (other["network"]["type"], shape.cooperative) == ("bev", "blind" not in name)


@pytest.mark.slow
def test_the_study_of_the_paper_has_what_it_promises() -> None:
    """Methods at four densities and 30 km/h, at one also 25 km/h; the oracle once."""
    (path,) = (path for path in FILES if path.stem == "paper_relay")
    experiment = load_experiment(path)
    assert len(experiment.seeds) >= 50
    conditions: dict[str, int] = {}
    for combination in experiment.combinations:
        method = combination.levels["method"]
        conditions[method] = conditions.get(method, 0) + 1
    assert conditions.pop("oracle") == 1
    assert conditions.pop("signal-strength-min") == 2
    assert conditions == dict.fromkeys(
        ["mohed", "signal-strength", "random", "direct", "expected-prr"], 5
    )
