"""Every experiment and recipe that ships is valid, with all its combinations and scenes."""

from pathlib import Path

import pytest

import studies
from orchestrator.experiment.load import load_experiment
from studies.training.load import load_training

FILES = sorted(Path(studies.__file__).parent.glob("*/experiments/*.yaml"))
RECIPES = sorted(Path(studies.__file__).parent.glob("*/recipes/*.yaml"))


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_it_is_valid(path: Path) -> None:
    assert load_experiment(path).runs()


@pytest.mark.parametrize("path", RECIPES, ids=lambda path: path.stem)
def test_a_recipe_is_valid(path: Path) -> None:
    assert all(each.scenes for each in load_training(path).encounters)


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
