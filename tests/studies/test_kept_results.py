"""The results that are committed are those of today's code: some runs of the studies, run again.

`python tests/studies/test_kept_results.py FIRST LAST` compares all committed runs of these seeds.
"""

import csv
import math
import sys
import tempfile
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import pytest
from typing_extensions import override

from fmus.driving.network.checkpoint import shipped
from orchestrator.experiment.load import load_experiment
from orchestrator.experiment.plan import Experiment
from orchestrator.run import run_scenario
from orchestrator.scenario.build import load_scenario
from orchestrator.scenario.extension import read
from studies.generalisation.runs import ADDITIONS, DRIVEN

ROOT = Path(__file__).parents[2]
RELAY = "studies/relay/experiments/paper_relay.yaml", "relay_runs.csv"
DRIVING = "studies/collision/experiments/collision_policies.yaml", "collision_policies_runs.csv"
GENERALISATION = {
    f"{encounter}{end}": (
        f"studies/generalisation/experiments/generalisation_{encounter}{end}.yaml",
        f"generalisation_{encounter}{end}_runs.csv",
    )
    for encounter, end in (*((each, "") for each in DRIVEN), *ADDITIONS)
}
"""By encounter; the networks of several encounters have experiments of their own."""
POINT_TRANSFORMER = "studies/collision/experiments/point_transformer.yaml"
_NOT_RESULTS = {"seed", "wall_s", "error"}


@dataclass(frozen=True)
class Kept:
    """A committed run.

    Attributes:
        study: the experiment file, and the table of its runs.
        levels: of its factors; enough of them to tell it from others.
        seed: of it.
    """

    study: tuple[str, str]
    levels: Mapping[str, str]
    seed: int

    @override
    def __str__(self) -> str:
        return " ".join([*self.levels.values(), str(self.seed)])


TRAINED = {
    "bev-16": Kept(DRIVING, {"policy": "cooperative-16"}, 111),
    "bev-32": Kept(DRIVING, {"policy": "cooperative-32"}, 110),
    "blind": Kept(DRIVING, {"policy": "blind"}, 112),
    "early-fusion": Kept(DRIVING, {"policy": "early-fusion"}, 113),
    "general-16": Kept(
        GENERALISATION["red_light_compression"],
        {"policy": "general-16, brake held", "variation": "as trained"},
        115,
    ),
    "general-32": Kept(
        GENERALISATION["red_light_general"],
        {"policy": "general-32", "variation": "as trained"},
        114,
    ),
    "general-blind": Kept(
        GENERALISATION["red_light_alone"],
        {"policy": "general-blind, brake held", "variation": "other lane"},
        116,
    ),
    "general-early-fusion": Kept(
        GENERALISATION["red_light_early"],
        {"policy": "general-early-fusion, brake held", "variation": "as trained"},
        118,
    ),
    "overtaking-32": Kept(
        GENERALISATION["overtaking_overtaker"],
        {"policy": "overtaking-32", "variation": "as it is"},
        117,
    ),
    "overtaking-blind": Kept(
        GENERALISATION["overtaking_overtaker_blind"],
        {"policy": "overtaking-blind", "variation": "nobody comes"},
        119,
    ),
}
"""Of every network that comes with the package a run in the scene that it was trained in."""


def committed(kept: Kept) -> Mapping[str, str]:
    """The row of the table, whose conditions are those of the scenario, not names of levels."""
    levels = dict(kept.levels)
    if levels.get("policy", "").startswith("cooperative-"):
        levels["policy"], _, levels["compression"] = levels["policy"].partition("-")
    with (ROOT / "docs" / "results" / kept.study[1]).open(encoding="utf-8", newline="") as stream:
        rows = [
            row
            for row in csv.DictReader(stream)
            if row["seed"] == str(kept.seed)
            and all(row[factor] == level for factor, level in levels.items())
        ]
    (row,) = rows
    return row


def differences(kept: Kept, experiment: Experiment) -> Iterator[str]:
    """Where a run of today is not the committed one; numbers are committed with six decimals."""
    (combination,) = [
        each for each in experiment.combinations if kept.levels.items() <= each.levels.items()
    ]
    scenario = load_scenario(
        experiment.scenario, (*combination.overrides, f"seed={kept.seed}", "report=red-light")
    )
    with tempfile.TemporaryDirectory() as folder:
        metrics = run_scenario(scenario, Path(folder) / "run", figure=False).metrics
    row = committed(kept)
    for column, path in experiment.metrics.items():
        value: object = metrics
        for key in path.split("."):
            value = value.get(key) if isinstance(value, Mapping) else None
        said = row[column]
        is_number = isinstance(value, int | float) and not isinstance(value, bool)
        if is_number:
            assert isinstance(value, int | float)
            same = bool(said) and math.isclose(float(said), value, abs_tol=5.1e-7)
        else:
            same = said == ("" if value is None else str(value))
        if not same:
            yield f"{kept}: {column} is {value}, committed is {said}"


@cache
def loaded(study: str) -> Experiment:
    """The experiment in this file, which takes seconds to check."""
    return load_experiment(ROOT / study)


@pytest.mark.slow
@pytest.mark.parametrize(
    "kept",
    [
        Kept(RELAY, {"method": "mohed", "density": "30 m", "speed": "30 km/h"}, 101),
        Kept(RELAY, {"method": "signal-strength", "density": "20 m", "speed": "30 km/h"}, 104),
        Kept(RELAY, {"method": "random", "density": "30 m", "speed": "25 km/h"}, 107),
        Kept(DRIVING, {"policy": "expert"}, 102),
        *TRAINED.values(),
    ],
    ids=str,
)
def test_a_run_is_what_it_was(kept: Kept) -> None:
    assert list(differences(kept, loaded(kept.study[0]))) == []


def name_of(policy: str) -> str:
    """Which network drives: the level of a policy begins with it, and says then how it is used."""
    return policy.split(", ", maxsplit=1)[0]


def network_runs() -> list[Kept]:
    """Of every network that comes with the package, in every encounter, where it is committed."""
    found: list[Kept] = []
    for study in GENERALISATION.values():
        path = ROOT / "docs" / "results" / study[1]
        text = path.read_text(encoding="utf-8") if path.is_file() else ""
        rows = csv.DictReader(text.splitlines())
        firsts: dict[str, Kept] = {}
        for row in rows:
            if name_of(row["policy"]) in shipped() and not row["error"]:
                levels = {factor: row[factor] for factor in ("policy", "variation")}
                firsts.setdefault(row["policy"], Kept(study, levels, int(row["seed"])))
        found += firsts.values()
    return found


@pytest.mark.slow
@pytest.mark.parametrize("kept", network_runs(), ids=lambda k: f"{k.study[1].split('.')[0]} {k}")
def test_a_network_drives_as_it_did(kept: Kept) -> None:
    """Collision, with whom, success, time and gap of one run each."""
    assert list(differences(kept, loaded(kept.study[0]))) == []


def test_every_network_that_ships_drives_here_where_it_was_trained_and_elsewhere() -> None:
    """Each in four runs at least, of which one is in the scene that it was trained in."""
    assert TRAINED.keys() == {*shipped()}
    elsewhere = [name_of(kept.levels["policy"]) for kept in network_runs()]
    assert {name for name in TRAINED if elsewhere.count(name) >= 3} == {*shipped()}


def test_every_network_that_ships_is_in_the_table() -> None:
    """Whoever ships one says how it drives in every encounter."""
    for encounter in DRIVEN:
        studies = [study for name, study in GENERALISATION.items() if name.startswith(encounter)]
        levels = [read(ROOT / study[0]).data["factors"]["policy"] for study in studies]
        assert {*shipped()} <= {name_of(policy) for each in levels for policy in each}


@pytest.mark.slow
def test_the_point_transformer_avoids_by_messages_whom_it_hits_without() -> None:
    """It is no network of the package, and need not drive the same bits everywhere: what it does.

    In the committed runs it collides in 6 of 50 if all messages arrive, and in 31 if none does.
    """
    pytest.importorskip("torch", reason="PyTorch is not installed")
    experiment = loaded(POINT_TRANSFORMER)
    found = {}
    for combination in experiment.combinations:
        setting = (*combination.overrides, "seed=102", "report=red-light")
        scenario = load_scenario(experiment.scenario, setting)
        with tempfile.TemporaryDirectory() as folder:
            metrics = run_scenario(scenario, Path(folder) / "run", figure=False).metrics
        found[combination.levels["messages"]] = metrics["collision"], metrics["success"]
    assert found == {"all arrive": (False, True), "none arrives": (True, False)}


def compare(first: int, last: int) -> int:
    """Compare all committed runs of seeds `first` to `last`; how many differ."""
    wrong = total = 0
    for study in (RELAY, DRIVING):
        experiment = load_experiment(ROOT / study[0])
        for seed in range(first, last + 1):
            for combination in experiment.combinations:
                found = list(differences(Kept(study, combination.levels, seed), experiment))
                total += 1
                wrong += bool(found)
                print(*found, sep="\n", end="\n" if found else "")  # noqa: T201 - a command
    print(f"{total} runs compared, {wrong} differ")  # noqa: T201 - a command
    return wrong


if __name__ == "__main__":
    sys.exit(compare(*map(int, sys.argv[1:3])) > 0)
