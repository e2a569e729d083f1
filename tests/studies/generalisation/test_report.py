"""The report `generalisation`, its table and its page, of runs whose ends we choose."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from orchestrator.experiment.plan import Combination, Experiment, ReportPlan
from orchestrator.intervals import Estimate, share
from orchestrator.scenario.document import Document
from orchestrator.scenario.extension import read
from studies.generalisation import Generalisation, statistics
from studies.generalisation.__main__ import main
from studies.generalisation.page import page, verdict
from studies.generalisation.published import COOPERNAUT, MODELS
from studies.generalisation.report import read_campaign, write_campaign
from studies.generalisation.runs import ADDED, ADDITIONS, METRICS
from studies.generalisation.statistics import Result
from studies.method import records
from tests.studies.results import Levels, check_manual, check_missing, results

POLICIES = ("expert", "blind", "bev-32")
VARIATIONS = ("as trained", "truck")
SEEDS = tuple(range(1, 5))
EXPERIMENTS = Path(statistics.__file__).parent / "experiments"


def plan(name: str = "generalisation_red_light", **parameters: Any) -> Experiment:
    levels = [{"policy": p, "variation": v} for p in POLICIES for v in VARIATIONS]
    return Experiment(
        path=Path(f"{name}.yaml"),
        document=Document("x.yaml", {}, {}),
        scenario=Path("x.yaml"),
        seeds=SEEDS,
        combinations=tuple(Combination(each, (), {}) for each in levels),
        metrics={each: each for each in METRICS},
        report=ReportPlan(name="generalisation", parameters=parameters),
    )


def outcome(levels: Levels, seed: int) -> dict[str, Any] | None:
    """The expert takes 10 s and fails at seed 4; the others take 12.5 s, or collide.

    The blind one collides always, the network with trucks at seeds 2 and 3; its run 4 breaks.
    """
    policy, variation = levels["policy"], levels["variation"]
    if policy == "expert":
        is_through = seed != 4
        return ended(collision=False, success=is_through, time=10.0 if is_through else None)
    if policy == "bev-32" and seed == 4:
        return None
    hit = policy == "blind" or (variation == "truck" and seed in {2, 3})
    return ended(collision=hit, success=not hit, time=None if hit else 12.5)


def ended(*, collision: bool, success: bool, time: float | None) -> dict[str, Any]:
    return {
        "collision": collision,
        "collision_partner": "collision vehicle" if collision else None,
        "success": success,
        "completion_time": time,
        "min_gap_m": 0.0 if collision else 1.5,
    }


def found(folder: Path, **parameters: Any) -> dict[tuple[str, str], Result]:
    Generalisation().write(results(plan(**parameters), outcome), folder)
    return {(row.policy, row.variation): row for row in read_campaign(folder)}


def problems(given: Experiment) -> list[tuple[tuple[str | int, ...], str]]:
    return [(each.address, each.what) for each in Generalisation().check(given)]


def test_shares_of_the_runs_that_did_not_fail(tmp_path: Path) -> None:
    rows = found(tmp_path)
    assert [(row.runs, row.collisions) for row in rows.values()] == [
        (4, 0),
        (4, 4),
        (3, 0),
        (4, 0),
        (4, 4),
        (3, 2),
    ]
    truck = rows["bev-32", "truck"]
    expected = share([True, True, False])
    assert truck.rate is not None
    assert truck.rate.low is not None
    assert (truck.rate.value, truck.rate.low) == pytest.approx((2 / 3, expected.low))
    assert (truck.least_gap_m, truck.partners) == (0.0, "collision vehicle 2")
    assert rows["bev-32", "as trained"].success == share([True] * 3)


def test_success_is_weighted_by_the_time_of_the_expert(tmp_path: Path) -> None:
    """10 s over 12.5 s where it succeeds, 0 where not; where the expert fails nothing counts."""
    rows = found(tmp_path)
    values = {key: None if row.sct is None else row.sct.value for key, row in rows.items()}
    assert values["expert", "truck"] == 1.0
    assert values["bev-32", "as trained"] == pytest.approx(0.8)
    assert values["bev-32", "truck"] == pytest.approx(0.8 / 3)
    assert values["blind", "truck"] == 0.0
    assert {row.sct_n for row in rows.values()} == {3}


def test_the_table_of_all_is_made_of_the_runs(tmp_path: Path) -> None:
    rows = found(tmp_path, trained={"as trained": ["bev-32"]})
    for name in ("generalisation_left_turn", "generalisation_overtaking"):
        Generalisation().write(results(plan(name), outcome), tmp_path)
    write_campaign(tmp_path)
    table = records.read(tmp_path / "generalisation.csv", Result)
    assert [row.encounter for row in table[::6]] == ["red light", "left turn", "overtaking"]
    assert table[0].variation == table[2].variation == "as trained"
    assert [key for key, row in rows.items() if row.trained] == [("bev-32", "as trained")]


SEEDS_OF = {
    "_general": "101..175",
    "_held": "101..175",
    "_seeds": "101..125",
    "_many": "126..481",
    "_compression": "101..125",
    "_seeds_16": "101..125",
    "_alone": "101..125",
    "_early": "101..125",
    "_one_side": "101..175",
    "_overtaker": "101..175",
    "_overtaker_blind": "101..125",
    "_elsewhere": "101..120",
    "_elsewhere_blind": "101..120",
    "_point": "101..110",
}
"""By whose runs they are, how many seeds can tell what is asked; the other policies have 20."""


@pytest.mark.parametrize(("end", "whose"), ADDED.items())
def test_networks_of_several_encounters_stand_beside_the_others(
    tmp_path: Path, end: str, whose: str
) -> None:
    """Their runs are of an experiment of their own; their times are weighted by the expert's."""
    found(tmp_path)
    general = plan(f"generalisation_red_light{end}", trained={"truck": ["general-32"]})
    alone = tuple(Combination({"policy": "general-32", "variation": v}, (), {}) for v in VARIATIONS)
    made = results(replace(general, combinations=alone), outcome)
    Generalisation().write(made, tmp_path)
    rows = [row for row in read_campaign(tmp_path) if row.variation == "truck"]
    assert [(row.policy, row.trained) for row in rows] == [
        ("expert", False),
        ("blind", False),
        ("bev-32", False),
        ("general-32", True),
    ]
    assert {row.encounter for row in rows} == {"red light"}
    # It gets through in 12.5 s of seed 1 only, where the expert solves 1 to 3 in 10 s.
    assert (rows[-1].runs, rows[-1].sct_n) == (4, 3)
    assert rows[-1].sct is not None
    assert rows[-1].sct.value == pytest.approx(0.8 / 3)
    text = page(tmp_path, "results", None)
    assert f"### Red light, {whose}\n" in text
    assert f"[every run](results/generalisation_red_light{end}_runs.csv)" in text


@pytest.mark.parametrize(("encounter", "added"), ADDITIONS)
def test_networks_of_several_encounters_meet_the_same(encounter: str, added: str) -> None:
    """The scenario, what is set and measured are those of the others, as are the variations.

    Other trainings have fewer of these; the first seed is the same, but for the many runs.
    """
    others, general = (
        read(EXPERIMENTS / f"generalisation_{encounter}{end}.yaml").data for end in ("", added)
    )
    assert general["factors"].pop("policy").keys().isdisjoint(others["factors"].pop("policy"))
    for each in (others, general):
        del each["report"]
    variations, those = (each["factors"].pop("variation") for each in (general, others))
    if added in {"_general", "_held", "_alone", "_early"}:
        assert variations == those
    assert variations.items() <= those.items()
    assert general.pop("seeds") == SEEDS_OF[added]
    assert others.pop("seeds") == "101..120"
    assert general == others


@pytest.mark.parametrize(
    ("given", "address", "what"),
    [
        ({"traind": {}}, ("traind",), "there is no parameter `traind`; did you mean `trained`?"),
        ({"trained": ["bev-32"]}, ("trained",), "expected lists of policies by variation"),
        ({"trained": {"van": []}}, ("trained", "van"), "there is no variation `van`"),
        (
            {"trained": {"truck": ["bev-32", "bev-8"]}},
            ("trained", "truck", 1),
            "there is no policy `bev-8`",
        ),
    ],
)
def test_parameters(given: dict[str, Any], address: tuple[str | int, ...], what: str) -> None:
    ((where, said),) = problems(plan(**given))
    assert (where, said[: len(what)]) == (address, what)


def test_what_it_needs() -> None:
    assert problems(plan(trained={"truck": ["blind"]})) == []
    alone = (Combination({"policy": "expert"}, (), {}),)
    lacking = replace(plan(), combinations=alone, metrics={"collision": "collision"})
    said = [what for _, what in problems(lacking)]
    assert said[0] == "the study of generalisation needs the factor `variation`"
    assert "`success: success`" in said[1]


@pytest.mark.parametrize(
    ("collisions", "runs", "trained", "word"),
    [
        (0, 380, True, "open"),
        (0, 381, True, "met"),
        (0, 72, False, "open"),
        (0, 73, False, "met"),
        (3, 20, False, "missed"),
        (2, 20, True, "missed"),
        (1, 20, False, "open"),
    ],
)
def test_a_target_is_met_or_missed_by_the_whole_interval(
    collisions: int, runs: int, *, trained: bool, word: str
) -> None:
    rate = share([True] * collisions + [False] * (runs - collisions))
    assert verdict(rate, trained=trained).word == word


def test_the_page(tmp_path: Path) -> None:
    found(tmp_path, trained={"as trained": ["bev-32"]})
    (tmp_path / "training").mkdir()
    (tmp_path / "training" / "general_32-evaluation.csv").write_text(
        "encounter,held_out,driver,runs,failed,collision,collision_low,collision_high,"
        "success,success_low,success_high\n"
        "skewed,True,round 1,4,0,0.25,0.05,0.7,0.75,0.3,0.95\n"
        ",False,round 1,4,0,0.5,0.15,0.85,0.5,0.15,0.85\n"
    )
    (tmp_path / "training" / "general_32-seeds.csv").write_text(
        "seed,round,encounter,held_out,runs,failed,collision\n"
        "1,4,left turn,False,4,0,0.25\n1,4,skewed,True,4,0,0.25\n"
        "7,3,left turn,False,4,0,0.0\n7,3,skewed,True,4,1,0.6666666666666666\n"
        "1,4,,False,4,0,0.25\n7,3,,False,4,0,0.25\n"
    )
    (tmp_path / "analysis.md").write_text("By hand.\n")
    text = page(tmp_path, "results", tmp_path / "analysis.md")
    lines = text.splitlines()
    assert "By hand." in lines
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines if "|" in line]
    cells = ["0 of 3*, 0 [0, 56]; 3 through", "2 of 3, 67 [21, 94]; 1 through"]
    assert ["bev-32", *cells] in rows
    beside = next(row for row in rows if row[:2] == ["red light", "blind"])
    assert beside[2:4] == ["4", "0.0 [0.0, 49.0]"]
    assert beside[4::2] == ["47.3 ± 18.7", "46.1 ± 18.4", "51.4 ± 17.4"]
    assert ["bev-32", "red light", "truck", "66.67 [20.77, 93.85]", "< 5", "missed"] in rows
    assert ["bev-32", "red light", "as trained", "0.00 [0.00, 56.15]", "< 1", "open"] in rows
    assert ["skewed", "yes", "4", "75.0 [30.0, 95.0]", "25.0 [5.0, 70.0]"] in rows
    assert ["as trained", "no", "4", "50.0 [15.0, 85.0]", "50.0 [15.0, 85.0]"] in rows
    assert ["encounter", "held out", "seed 1", "seed 7", "collisions [%]"] in rows
    assert ["as trained", "no", "1 of 4", "1 of 4", "25.0 ± 0.0"] in rows
    assert ["left turn", "no", "1 of 4", "0 of 4", "12.5 ± 17.7"] in rows
    assert ["skewed", "yes", "1 of 4", "2 of 3", "45.8 ± 29.5"] in rows
    assert "training `general-32`" in text
    assert "[every run](results/generalisation_red_light_runs.csv)" in text


def test_what_was_published_adds_up() -> None:
    """Success weighted by time is no more than success; both with collisions no more than all."""
    assert len(COOPERNAUT) == 12
    assert {model for _, model in COOPERNAUT} >= set(MODELS.values())
    for row in COOPERNAUT.values():
        assert row.sct.value <= row.success.value
        assert row.success.value + row.collisions.value <= 100.0
    assert str(COOPERNAUT["left turn", "COOPERNAUT"].success) == "80.7 ± 5.2"


def test_an_estimate_without_bounds_is_open() -> None:
    assert verdict(Estimate(0.0, None, None), trained=True).word == "open"


def test_the_page_in_the_manual_is_that_of_the_committed_results() -> None:
    check_manual("generalisation", page)


def test_without_results_there_is_no_page(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    file = "generalisation_red_light_runs.csv"
    check_missing(file, main, monkeypatch, tmp_path, capsys)
