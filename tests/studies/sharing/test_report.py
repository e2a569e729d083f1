"""The report and the page: tables by hand, what is refused, and the page in the manual."""

import json
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import pytest

from orchestrator.experiment.plan import Combination, Experiment, ReportPlan
from orchestrator.recording.layout import write_json
from orchestrator.scenario.document import Document
from studies.method import records
from studies.method.origin import Machine, Origin, Session
from studies.sharing.__main__ import main
from studies.sharing.choice import Moment
from studies.sharing.moments import Choice, scores
from studies.sharing.page import draw, page
from studies.sharing.report import SharingStudy
from studies.sharing.results import Result, results as read
from tests.studies.results import Levels, check_manual, check_missing, results

METRICS = {"sharing_kbyte_s": "measures.air.sharing_kbyte_s", "collision": "collision"}


def experiment(
    metrics: Mapping[str, str] = METRICS, factor: str = "method", **parameters: Any
) -> Experiment:
    combinations = [
        Combination({factor: method, "lidars": lidars}, (), {"components": {}})
        for method in ("apmm", "cpm")
        for lidars in ("10 %", "20 %")
    ]
    return Experiment(
        path=Path("sharing_methods.yaml"),
        scenario=Path("scenario.yaml"),
        seeds=(1, 2, 3),
        combinations=tuple(combinations),
        metrics=metrics,
        report=ReportPlan(name="sharing-study", parameters=parameters),
        document=Document("sharing_methods.yaml", {}, {}),
    )


def outcome(levels: Levels, seed: int) -> dict[str, object] | None:
    if (levels["method"], seed) == ("cpm", 3):
        return None
    kbytes = {"apmm": 60.0, "cpm": 20.0}[levels["method"]] + seed
    return {"sharing_kbyte_s": kbytes, "collision": levels["method"] == "cpm" and seed == 1}


def test_tables_have_means_over_the_runs_that_did_not_fail(tmp_path: Path) -> None:
    SharingStudy().write(results(experiment(), outcome), tmp_path)
    rows = read(tmp_path, "sharing_methods")
    assert [(row.method, row.lidars, row.n) for row in rows] == [
        ("apmm", "10 %", 3),
        ("apmm", "20 %", 3),
        ("cpm", "10 %", 2),
        ("cpm", "20 %", 2),
    ]
    apmm, _, cpm, _ = rows
    assert apmm.sharing_kbyte_s is not None
    assert apmm.sharing_kbyte_s.value == pytest.approx(62.0)
    assert cpm.sharing_kbyte_s is not None
    assert cpm.sharing_kbyte_s.value == pytest.approx(21.5)
    assert cpm.collision is not None
    assert cpm.collision.value == 0.5
    runs = (tmp_path / "sharing_methods_runs.csv").read_text()
    assert len(runs.splitlines()) == 1 + 4 * 3
    assert "wall_s" not in runs
    origin = json.loads((tmp_path / "sharing_methods_provenance.json").read_text())
    assert (origin["planned"], origin["runs"], origin["failed"]) == (12, 12, 2)
    assert "secret" not in (tmp_path / "sharing_methods_provenance.json").read_text()


@pytest.mark.parametrize(
    ("plan", "what"),
    [
        (experiment(factor="way"), "the sharing study needs the factor `method`"),
        (
            experiment(metrics={"collision": "collision"}),
            "the sharing study needs the metric `sharing_kbyte_s`",
        ),
        (experiment(base=1), "there is no parameter `base`"),
    ],
)
def test_what_it_needs(plan: Experiment, what: str) -> None:
    assert [problem.what for problem in SharingStudy().check(plan)] == [what]


def test_a_sound_experiment_has_no_problems() -> None:
    assert list(SharingStudy().check(experiment())) == []


def moment(**values: Any) -> Moment:
    usual = dict.fromkeys(Moment.__dataclass_fields__, 0) | {"chosen": 3, "best": 3, "most": 100.0}
    return Moment(**{**usual, **values})


def choice(seed: int, **values: Any) -> Choice:
    return Choice(scene="city", share=0.2, seed=seed, parameters="apmm", moment=moment(**values))


def test_scores_are_means_over_seeds_of_the_means_of_each() -> None:
    """Seed 1: regrets 0 and 0.5; seed 2: 1, with nobody chosen."""
    found = [
        choice(1, revealed=100.0, nearest=50.0, mean=25.0),
        choice(1, revealed=50.0, nearest=50.0, mean=25.0, chosen=4),
        choice(2, revealed=0.0, nearest=100.0, mean=75.0, chosen=-1),
    ]
    (score,) = scores(found)
    assert (score.seeds, score.looks) == (2, 3)
    values = {
        name: value["value"] for name, value in asdict(score).items() if isinstance(value, dict)
    }
    assert values["regret"] == pytest.approx((0.25 + 1.0) / 2)
    assert values["right"] == pytest.approx(0.25)
    assert values["best"] == pytest.approx(0.25)
    assert values["missed"] == pytest.approx(0.5)
    assert values["regret_nearest"] == pytest.approx(0.25)
    assert values["regret_random"] == pytest.approx((0.75 + 0.25) / 2)


def test_right_is_95_percent_of_the_best() -> None:
    (almost,) = scores([choice(1, revealed=95.1)])
    (short,) = scores([choice(1, revealed=94.9)])
    assert almost.right is not None
    assert short.right is not None
    assert (almost.right.value, short.right.value) == (1.0, 0.0)
    assert almost.best is not None
    assert almost.best.value == 0.0


def written(folder: Path) -> None:
    machine = Machine(cpu="a CPU", cpus=2, memory_gib=8.0, platform="Linux")
    session = Session(command="it", created="then", commit="abc", versions={}, machine=machine)
    origin = Origin(
        experiment="moments", seeds="1", planned=1, runs=1, failed=0, sessions=(session,)
    )
    write_json(folder / "moments_provenance.json", asdict(origin))
    records.write(folder / "moments.csv", records.rows(scores([choice(1, revealed=80.0)])))
    SharingStudy().write(results(experiment(), outcome), folder)


def test_the_page_has_the_numbers_and_what_was_written_by_hand(tmp_path: Path) -> None:
    written(tmp_path)
    (tmp_path / "analysis.md").write_text("## Found by hand\n")
    draw(tmp_path)
    text = page(tmp_path, "results", tmp_path / "analysis.md")
    assert "## Found by hand" in text
    assert "| city | 20 % | apmm | 1 | 1 |" in text
    assert "| CPM | 10 % | 2 | 1 of 2 |" in text
    assert "| APMM, seen area | 20 % | 3 | - | - | - | 62.0 | - |" in text
    assert "Parallel sessions" not in text  # that experiment was not run
    assert (tmp_path / "apmm_choice.svg").is_file()
    assert (tmp_path / "apmm_bytes.svg").is_file()


def test_the_page_in_the_manual_is_that_of_the_results_beside_it() -> None:
    check_manual("apmm", page)


def test_results_that_are_not_there_are_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    check_missing("moments.csv", main, monkeypatch, tmp_path, capsys)


def test_a_row_of_a_table_may_lack_what_an_experiment_does_not_have(tmp_path: Path) -> None:
    (tmp_path / "t.csv").write_text("method,n,cbr,cbr_low,cbr_high\napmm,1,0.25,,\n")
    (row,) = records.read(tmp_path / "t.csv", Result)
    assert row.cbr is not None
    assert (row.cbr.value, row.cbr.low, row.regret) == (0.25, None, None)
