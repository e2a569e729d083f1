"""The files of the report: deterministic, made of what there is, without names of hosts."""

import csv
import json
from pathlib import Path
from typing import Any

import pytest

from orchestrator.experiment.plan import Experiment
from studies.relay import RelayStudy
from studies.relay.__main__ import main
from studies.relay.page import page
from tests.studies.relay.synthetic import experiment, run
from tests.studies.results import Levels, check_manual, check_missing, results

METHODS = ("mohed", "signal-strength", "random", "direct", "oracle", "my-own")


def outcome(levels: Levels, seed: int) -> dict[str, Any]:
    method = METHODS.index(levels["method"])
    return run(0.9 - 0.1 * method - 0.01 * ((seed * 7 + method) % 5), switches=method)


def plan() -> Experiment:
    return experiment(METHODS, (20.0, 30.0), base={"density": "30 m"})


def write(folder: Path, *, without: int | None = None) -> dict[str, bytes]:
    folder.mkdir()
    RelayStudy().write(results(plan(), outcome, without=without), folder)
    return {path.name: path.read_bytes() for path in folder.iterdir()}


@pytest.mark.slow
def test_equal_results_make_equal_bytes(tmp_path: Path) -> None:
    first, second = write(tmp_path / "first"), write(tmp_path / "second")
    assert first == second
    assert sorted(first) == [
        "figure7.csv",
        "figure7.png",
        "figure7.svg",
        "figure8.csv",
        "figure8.png",
        "figure8.svg",
        "relay_claims.csv",
        "relay_differences.csv",
        "relay_provenance.json",
        "relay_runs.csv",
        "table2.csv",
        "table2_all.csv",
    ]
    assert b"<dc:date>" not in first["figure7.svg"]


@pytest.mark.slow
def test_other_results_make_other_figures(tmp_path: Path) -> None:
    whole, part = write(tmp_path / "whole"), write(tmp_path / "part", without=3)
    assert all(whole[name] != part[name] for name in ("figure7.svg", "figure8.svg"))


def test_an_interrupted_experiment_has_a_report_of_what_there_is(tmp_path: Path) -> None:
    files = write(tmp_path / "part", without=3)
    rows = list(csv.DictReader(files["table2.csv"].decode().splitlines()))
    assert {row["n"] for row in rows} == {"3"}
    origin = json.loads(files["relay_provenance.json"])
    assert (origin["planned"], origin["runs"], origin["failed"]) == (48, 36, 0)


def test_nothing_at_all_has_a_report_too(tmp_path: Path) -> None:
    empty = results(experiment(("mohed",), base={}, seeds=1), outcome, without=1)
    assert "mohed" in RelayStudy().write(empty, tmp_path).text
    assert (tmp_path / "figure8.svg").is_file()


@pytest.mark.slow
def test_the_origin_names_commit_and_machine_but_no_host(tmp_path: Path) -> None:
    text = write(tmp_path / "out")["relay_provenance.json"].decode()
    assert "secret" not in text
    (session,) = json.loads(text)["sessions"]
    assert session["command"] == "nlosim experiment study.yaml"
    assert session["commit"] == "abcdef"
    assert session["machine"]["cpu"] == "a CPU"


@pytest.mark.slow
def test_the_cost_is_time_of_workers_over_simulated_time(tmp_path: Path) -> None:
    origin = json.loads(write(tmp_path / "out")["relay_provenance.json"])
    first, *_, total = origin["cost"]
    assert (first["method"], first["runs"]) == ("mohed", 8)
    assert first["wall_s_per_simulated_s"] == pytest.approx(5.0 / 20.0)
    assert (total["runs"], total["simulated_s"]) == (48, 960.0)


@pytest.mark.slow
def test_the_page_has_the_numbers_and_keeps_what_was_written_by_hand(tmp_path: Path) -> None:
    write(tmp_path / "relay")
    analysis = tmp_path / "relay-analysis.md"
    analysis.write_text("## Analysis\n\nBecause of the queue.\n")
    text = page(tmp_path / "relay", "results/relay", analysis)
    assert text == page(tmp_path / "relay", "results/relay", analysis)
    assert "Because of the queue." in text
    assert "](results/relay/figure7.svg)" in text
    row = next(line for line in text.splitlines() if line.startswith("| MoHeD | 4 |"))
    assert row.startswith("| MoHeD | 4 | 87.5 [")  # 0.9 - (0.02 + 0.04 + 0.01 + 0.03) / 4
    assert "| 87.98 |" in row
    assert "| my-own | 4 |" in text
    assert "command: `nlosim experiment study.yaml`" in text
    analysis.unlink()
    assert "Because" not in page(tmp_path / "relay", "results/relay", analysis)


def problems(changed: Experiment) -> list[tuple[tuple[str | int, ...], str]]:
    return [(each.address, each.what) for each in RelayStudy().check(changed)]


def test_a_sound_experiment_has_no_problems() -> None:
    assert problems(plan()) == []
    assert problems(experiment(METHODS)) == []  # a single level needs no base


@pytest.mark.parametrize(
    ("base", "address", "what"),
    [
        ({}, ("base",), "which level of `density` is that of Table II? There are: 20 m, 30 m"),
        (
            {"density": "35 m"},
            ("base", "density"),
            "the factor `density` has no level `35 m` that is run; did you mean `30 m`?",
        ),
        (
            {"density": "30 m", "sped": "fast"},
            ("base", "sped"),
            "there is no factor `sped` besides `method`; there are: density",
        ),
        ("30 m", ("base",), "expected a mapping from factors to levels, e.g. `{density: 30 m}`"),
    ],
)
def test_problems_of_the_base(base: Any, address: tuple[str, ...], what: str) -> None:
    found = problems(experiment(METHODS, (20.0, 30.0), base=base))
    assert (address, what) in found


def test_the_page_in_the_manual_is_that_of_the_results_beside_it() -> None:
    check_manual("relay", page)


def test_results_that_are_not_there_are_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    check_missing("relay_provenance.json", main, monkeypatch, tmp_path, capsys)
