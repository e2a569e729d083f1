"""The runs of the collision campaign in the study of generalisation."""

from dataclasses import replace
from pathlib import Path

import pytest

from orchestrator.scenario.extension import read
from studies.generalisation.campaign import (
    AS_TRAINED,
    EXPERIMENT,
    TRAINED,
    Row,
    different,
    with_campaign,
)
from studies.generalisation.page import page
from studies.generalisation.report import RED_LIGHT, read_campaign
from studies.generalisation.runs import SUFFIX, Run
from studies.method import records

STUDIES = Path(__file__).parents[3] / "studies"

ROW = Row(
    policy="cooperative",
    compression=32,
    seed=101,
    collision=False,
    collision_partner=None,
    success=True,
    completion_time=15.5,
    min_gap_m=2.0,
    wall_s=3.0,
    error=None,
)
OWN = replace(ROW.run, wall_s=99.0)


def campaign(folder: Path, *rows: Row) -> Path:
    records.write(folder / f"{EXPERIMENT}{SUFFIX}", records.rows(rows))
    return folder


def keys(runs: list[Run]) -> list[tuple[str, str, int]]:
    return [(run.policy, run.variation, run.seed) for run in runs]


def test_runs_of_the_campaign_take_the_place_of_those_as_trained(tmp_path: Path) -> None:
    """Policies keep their order; what only this study made stays."""
    expert = replace(OWN, policy="expert", trained=False)
    truck = replace(OWN, variation="truck", trained=False)
    rows = [replace(ROW, seed=seed) for seed in (101, 102)]
    expert_row = replace(ROW, policy="expert", compression=None, seed=103)
    found = with_campaign(campaign(tmp_path, *rows, expert_row), [expert, OWN, truck])
    assert keys(found) == [
        ("expert", AS_TRAINED, 103),
        ("expert", AS_TRAINED, 101),
        ("bev-32", AS_TRAINED, 101),
        ("bev-32", AS_TRAINED, 102),
        ("bev-32", "truck", 101),
    ]
    assert {run.trained for run in found if run.policy == "bev-32"} == {True, False}
    assert [run.wall_s for run in found if run.seed == 102] == [3.0]


@pytest.mark.parametrize(
    "other",
    [
        replace(ROW, collision=True),
        replace(ROW, success=False),
        replace(ROW, completion_time=15.6),
        replace(ROW, min_gap_m=1.9),
    ],
)
def test_a_policy_that_came_out_differently_keeps_its_own_runs(tmp_path: Path, other: Row) -> None:
    """Neither its runs of the campaign count nor others of it; another policy's do."""
    expert = replace(ROW, policy="expert", compression=None)
    campaign(tmp_path, replace(other, seed=100), replace(other, seed=102), other, expert)
    later, earlier = replace(OWN, seed=102), replace(OWN, seed=101)
    runs = [later, earlier, replace(OWN, policy="expert", trained=False)]
    assert different(tmp_path, runs) == {"bev-32": 101}
    found = with_campaign(tmp_path, runs)
    assert found == [later, earlier, expert.run]
    records.write(tmp_path / f"{RED_LIGHT}{SUFFIX}", records.rows(runs))
    assert [(row.policy, row.runs) for row in read_campaign(tmp_path)] == [
        ("bev-32", 2),
        ("expert", 1),
    ]
    text = page(tmp_path, "results", None)
    assert "equal, but for `bev-32` (seed 101): the campaign ran other code" in text


def test_a_variation_is_not_what_the_campaign_ran(tmp_path: Path) -> None:
    campaign(tmp_path, replace(ROW, collision=True))
    assert different(tmp_path, [replace(OWN, variation="truck")]) == {}


def test_without_the_campaign_the_runs_are_those_of_the_study(tmp_path: Path) -> None:
    assert with_campaign(tmp_path, [OWN]) == [OWN]


def test_the_page_says_whose_runs_they_are(tmp_path: Path) -> None:
    """None of 400 collides: less than 1 % holds, at most 0.95 %."""
    campaign(tmp_path, *(replace(ROW, seed=seed) for seed in range(400)))
    records.write(tmp_path / f"{RED_LIGHT}{SUFFIX}", records.rows([OWN]))
    (row,) = read_campaign(tmp_path)
    assert (row.runs, row.collisions, row.trained) == (400, 0, True)
    text = page(tmp_path, "results", None)
    assert "| bev-32 | red light | as trained | 0.00 [0.00, 0.95] | < 1 | met |" in text
    assert "are those of its experiment `collision_policies`" in text
    assert "it came out\nequal.\n" in text


def test_both_experiments_are_the_same_scene_without_losses() -> None:
    """All that they set but the metrics, and the networks that were trained in it."""
    theirs = read(STUDIES / "collision" / "experiments" / f"{EXPERIMENT}.yaml").data
    ours = read(STUDIES / "generalisation" / "experiments" / f"{RED_LIGHT}.yaml").data
    assert Path(theirs["scenario"]).name == Path(ours["scenario"]).name
    said = {name: value for name, value in ours["set"].items() if name != "measures"}
    channel = said.pop("components.channel.parameters")
    said |= {f"components.channel.parameters.{name}": value for name, value in channel.items()}
    boxes = said.pop("components.perception.parameters.boxes")  # as the scenario has them
    scenario = read(STUDIES.parent / "scenarios" / Path(theirs["scenario"]).name).data
    assert boxes == scenario["components"]["perception"]["parameters"]["boxes"]
    assert theirs["set"] == said
    levels = dict(theirs["factors"]["policy"])
    for compression in (16, 32):
        levels[f"bev-{compression}"] = levels.pop(f"cooperative-{compression}")
    assert {name: ours["factors"]["policy"][name] for name in levels} == levels
    assert ours["factors"]["variation"][AS_TRAINED] == {}
    assert set(ours["report"]["parameters"]["trained"][AS_TRAINED]) == {*TRAINED}
