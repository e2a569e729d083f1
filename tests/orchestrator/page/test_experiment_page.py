"""The page of an experiment: the numbers of its tables, whatever became of its runs."""

import errno
import json
import re
from collections.abc import Mapping
from contextlib import closing
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from orchestrator.campaign.conduct import Options
from orchestrator.campaign.work import RunKey
from orchestrator.campaign.workers import local_pool
from orchestrator.cli import main
from orchestrator.cli.experiment import _report_failed
from orchestrator.cli.outcome import Exit
from orchestrator.experiment.conduct import ExperimentOutcome, _Runs
from orchestrator.experiment.journal import Journal
from orchestrator.experiment.page.asked import numbers, ranges
from orchestrator.experiment.page.page import SCRIPTS, make_joint_page, make_page
from orchestrator.experiment.plan import Experiment
from tests.orchestrator.page.results import Outcome, conducted, planned
from tests.orchestrator.page.test_page import MOST_LINES, data_of

EVIL = "</script><script>alert(1)</script><!--\u2028&'\"$(rm x)"


def small() -> Experiment:
    """Two methods at two densities with four seeds."""
    factors = {"method": ["near", EVIL], "density": ["30 m", "60 m"]}
    return planned(factors, [1, 2, 3, 5], {"prr": "prr.all", "hit": "hit", "who": "who"})


def became(key: RunKey, levels: Mapping[str, str]) -> Outcome:
    """Metrics that depend on the combination and the seed; one run fails."""
    if key == RunKey(3, 1):
        return f"`car`: broke at 1 s {EVIL}"
    far = levels["density"] == "60 m"
    found = {"prr": {"all": 0.5 + 0.1 * key.combination + 0.01 * key.seed**2, "unit": "m"}}
    return {**found, "hit": far and key.seed < 3, "who": None if far else EVIL}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return conducted(tmp_path / "street", small(), became)


def test_report_writes_the_page_which_needs_nothing_from_elsewhere(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("pyarrow", reason="needs the extra `experiment`")
    assert main(["report", str(folder), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["page"] == str(folder / "index.html")
    text = (folder / "index.html").read_text()
    assert "default-src 'none'" in text
    assert not re.findall(r"""(?:src|href)=["'](?!data:)""", text)
    assert len(text) < 150_000


def test_equal_results_make_equal_bytes(folder: Path) -> None:
    before = make_page(folder).read_bytes()
    assert make_page(folder).read_bytes() == before


def test_names_and_errors_cannot_end_the_script_that_they_stand_in(folder: Path) -> None:
    page = make_page(folder)
    assert page.read_text().count("</script") == 3  # those of the template
    data = data_of(page)
    assert data["factors"][0]["levels"] == ["near", EVIL]
    assert list(data["runs"]["errors"].values()) == [f"`car`: broke at 1 s {EVIL}"]


def test_a_complete_experiment_says_what_was_asked_and_what_is_there(folder: Path) -> None:
    about = data_of(make_page(folder))["about"]
    assert (about["planned"], about["done"], about["failed"], about["missing"]) == (16, 16, 1, 0)
    (part,) = about["parts"]
    assert (about["title"], about["seeds"]) == ("street", "1 to 3, 5")
    assert part["scenario_title"] == "A street"
    assert about["common"] == ["time.stop=2 s"]
    (session,) = part["sessions"]
    assert {"command", "created", "commit", "versions", "host"} <= set(session)


def test_an_interrupted_experiment_says_what_is_missing_and_how_to_go_on(tmp_path: Path) -> None:
    out = conducted(tmp_path / "out", small(), lambda k, v: None if k.seed > 2 else became(k, v))
    about = data_of(make_page(out))["about"]
    assert (about["done"], about["missing"]) == (8, 8)
    assert about["parts"][0]["go_on"] == "nlosim experiment street.yaml --out there --resume"


def test_an_experiment_of_which_nothing_is_done_has_a_page(tmp_path: Path) -> None:
    data = data_of(make_page(conducted(tmp_path / "out", small(), lambda _, __: None)))
    assert (data["about"]["missing"], data["counts"]) == (16, [0, 0, 0, 0])


def test_damaged_lines_are_named_and_the_rest_is_used(folder: Path) -> None:
    journal = folder / "runs.jsonl"
    lines = journal.read_text().splitlines(keepends=True)
    lines[4] = lines[4].replace('"wall": 1.5', '"wall": 1.6')
    journal.write_text("".join(lines))
    about = data_of(make_page(folder))["about"]
    (said,) = about["damaged"]
    assert said.startswith("`runs.jsonl`, line 5: damaged")
    assert (about["done"], about["missing"]) == (15, 1)


def test_a_metric_is_averaged_counted_or_only_listed(folder: Path) -> None:
    metrics = {each["name"]: each for each in data_of(make_page(folder))["metrics"]}
    kinds = {name: metric["kind"] for name, metric in metrics.items()}
    assert kinds == {"prr": "number", "hit": "share", "who": "text", "wall_s": "number"}
    assert metrics["prr"]["unit"] == "m"
    assert metrics["wall_s"]["unit"] == "s"


def test_the_directories_of_runs_are_found_the_last_attempt_and_their_pages(folder: Path) -> None:
    for name in ("1-seed-1", "1-seed-2", "1-seed-2-2", "1-seed-2-x", "9-seed-1"):
        (folder / "runs" / name).mkdir(parents=True)
    (folder / "runs" / "1-seed-2-2" / "index.html").touch()
    found = data_of(make_page(folder))["folders"]
    assert found == {"0": ["runs/1-seed-1", False], "1": ["runs/1-seed-2-2", True]}


def test_three_thousand_runs_fit_into_a_megabyte(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("os.fsync", lambda _: None)
    rng = np.random.default_rng(1)
    names = [f"m{k}" for k in range(9)]
    factors = {"a": list("ABCDEFGHIJ"), "b": list("123456")}
    plan = planned(factors, range(50), {name: name for name in names})
    values = iter(rng.normal(size=(3000, 9)).tolist())
    folder = conducted(
        tmp_path / "out", plan, lambda _, __: dict(zip(names, next(values), strict=True))
    )
    page = make_page(folder)
    assert page.stat().st_size < 700_000
    assert data_of(page)["runs_left_out"] == 0


def test_more_runs_than_fit_leave_out_the_last_seeds_and_say_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Means and differences are of all runs, nevertheless."""
    monkeypatch.setattr("orchestrator.experiment.page.columns.MOST_VALUES", 4 * 4 * 2)
    folder = conducted(tmp_path / "out", small(), became)
    data = data_of(make_page(folder))
    assert data["runs"]["seeds"] == ["1", "2"]
    assert data["runs_left_out"] == 8
    assert data["counts"] == [4, 3, 4, 4]


def test_more_combinations_than_fit_leave_out_the_last_ones_and_say_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("orchestrator.experiment.page.columns.MOST_ESTIMATES", 3 * 4)
    data = data_of(make_page(conducted(tmp_path / "out", small(), became)))
    assert len(data["levels"]) == 3
    assert data["combinations_left_out"] == 1


def test_more_differences_than_fit_leave_out_those_to_other_levels_than_the_first(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of three levels three pairs, two of which with the first one."""
    monkeypatch.setattr("orchestrator.experiment.page.contrasts.MOST", 4)
    plan = planned({"a": ["x", "y", "z"]}, [1, 2], {"m": "m"})
    folder = conducted(tmp_path / "out", plan, lambda k, _: {"m": k.seed})
    pairs = data_of(make_page(folder))["pairs"]
    assert (pairs["left_out"], pairs["first"]["n"]) == (1, 2)


@pytest.mark.parametrize(
    ("levels", "found", "unit"),
    [
        (["30 km/h", "50 km/h"], [30.0, 50.0], "km/h"),
        (["0.5", "1e-3", "-2"], [0.5, 0.001, -2.0], ""),
        (["30 m", "60 s"], None, ""),
        (["30 m", "far"], None, ""),
        (["1", "1.0"], None, ""),
        (["30 m"], None, ""),
    ],
)
def test_levels_are_numbers_if_all_are_of_one_unit_and_differ(
    levels: list[str], found: list[float] | None, unit: str
) -> None:
    assert numbers(levels) == {"numbers": found, "unit": unit}


def test_seeds_are_told_as_ranges() -> None:
    assert ranges([5, 1, 2, 3, 9, 8]) == "1 to 3, 5, 8 to 9"


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda path: path.name)
def test_scripts_are_short_and_set_names_as_text_only(script: Path) -> None:
    text = script.read_text()
    assert len(text.splitlines()) < MOST_LINES
    assert not re.findall(r"innerHTML|outerHTML|insertAdjacent|document\.write|eval\(", text)


def driving() -> Experiment:
    """Another experiment, which has a speed and no density, and another metric."""
    factors = {"method": ["near", "far"], "speed": ["30 km/h", "50 km/h"]}
    plan = planned(factors, [1, 2], {"prr": "prr.all", "gap": "gap"}, "/scenes/lane.yaml")
    return replace(plan, path=Path("/studies/driving.yaml"))


@pytest.fixture
def two(folder: Path, tmp_path: Path) -> tuple[Path, Path]:
    """The directories of two experiments."""
    found = {"prr": {"all": 0.25}, "gap": 7.5}
    other = conducted(tmp_path / "driving", driving(), lambda k, _: found if k.seed < 2 else None)
    return folder, other


def test_two_experiments_on_one_page_have_a_factor_that_tells_them_apart(
    two: tuple[Path, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    page = tmp_path / "both.html"
    assert main(["report", *map(str, two), "--page", str(page), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["page"] == str(page)
    data = data_of(page)
    factors = {each["name"]: each["levels"] for each in data["factors"]}
    assert factors == {
        "experiment": ["street", "driving"],
        "method": ["near", EVIL, "far"],
        "density": ["30 m", "60 m", "-"],
        "speed": ["-", "30 km/h", "50 km/h"],
    }
    assert [each["name"] for each in data["metrics"]] == ["prr", "hit", "who", "gap", "wall_s"]
    about = data["about"]
    assert (about["title"], about["planned"], about["done"], about["missing"]) == (
        "both",
        24,
        20,
        4,
    )
    assert [part["missing"] for part in about["parts"]] == [0, 4]
    assert data["counts"] == [4, 3, 4, 4, 1, 1, 1, 1]
    heads = [part["head"] for part in data["commands"]["parts"]]
    assert heads == [
        "nlosim run '/scenes/street corner.yaml' --seed",
        "nlosim run /scenes/lane.yaml --seed",
    ]
    assert "street/summary.csv" not in data["files"]  # no table was made
    assert {"street/runs.jsonl", "driving/runs.jsonl"} <= set(data["files"])


def test_the_runs_of_joined_experiments_are_found_in_their_directories(
    two: tuple[Path, Path], tmp_path: Path
) -> None:
    """Combinations are counted from 1 in each."""
    for folder in two:
        (folder / "runs" / "1-seed-1").mkdir(parents=True)
    page = tmp_path / "pages" / "both.html"
    page.parent.mkdir()
    make_joint_page(two, page)
    found = data_of(page)["folders"]
    assert found == {
        "0": ["../street/runs/1-seed-1", False],
        "16": ["../driving/runs/1-seed-1", False],
    }


def test_an_experiment_with_itself_is_told_apart_by_a_number(folder: Path, tmp_path: Path) -> None:
    make_joint_page([folder, folder], tmp_path / "both.html")
    assert data_of(tmp_path / "both.html")["factors"][0]["levels"] == ["street", "street (2)"]


def test_what_is_a_factor_here_and_a_metric_there_cannot_be_joined(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    other = conducted(
        tmp_path / "out", planned({"prr": ["a"]}, [1], {"m": "m"}), lambda _, __: None
    )
    assert main(["report", str(folder), str(other), "--page", str(tmp_path / "x.html")]) == 2
    assert "`prr` is a factor of one experiment and a metric of another" in capsys.readouterr().err


def test_one_page_of_several_needs_a_place_that_can_be_written(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["report", str(folder), str(folder)]) == 2
    assert "several directories need --page FILE" in capsys.readouterr().err
    nowhere = tmp_path / "missing" / "x.html"
    assert main(["report", str(folder), str(folder), "--page", str(nowhere)]) == 2
    assert f"`{nowhere}` cannot be written: No such file" in capsys.readouterr().err
    assert main(["report", str(folder), str(tmp_path), "--page", str(tmp_path / "x.html")]) == 2
    assert "holds no experiment" in capsys.readouterr().err


def test_the_factor_that_tells_experiments_apart_has_a_name_of_its_own(tmp_path: Path) -> None:
    """Whether a factor or a metric has that name already."""
    plan = planned({"experiment": ["a"]}, [1], {"experiment_": "m"})
    folder = conducted(tmp_path / "out", plan, lambda _, __: {"m": 1})
    make_joint_page([folder, folder], tmp_path / "both.html")
    names = [each["name"] for each in data_of(tmp_path / "both.html")["factors"]]
    assert names == ["experiment__", "experiment"]


def test_a_seed_of_all_combinations_is_on_the_page_however_many_there_are(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("orchestrator.experiment.page.columns.MOST_VALUES", 1)
    data = data_of(make_page(conducted(tmp_path / "out", small(), became)))
    assert (data["runs"]["seeds"], data["runs_left_out"]) == (["1"], 12)


def ended(folder: Path, *, page: bool) -> ExperimentOutcome:
    """What an experiment comes to when its last run is done."""
    pytest.importorskip("pyarrow", reason="needs the extra `experiment`")
    options = Options(
        out=folder,
        pool=partial(local_pool, 1, "experiment"),
        resume=True,
        progress=False,
        command="",
        check=lambda: None,
    )
    runs = _Runs(small(), options, keep_runs=False, page=page)
    with closing(Journal.resume(folder, small(), "nlosim experiment")) as journal:
        return runs.outcome(folder, journal)


@pytest.mark.parametrize("page", [True, False])
def test_an_experiment_ends_with_its_page_unless_nobody_wants_it(
    folder: Path, *, page: bool
) -> None:
    outcome = ended(folder, page=page)
    assert outcome.page == (folder / "index.html" if page else None)
    assert (folder / "index.html").exists() == page
    assert outcome.report_error is None


def test_a_page_that_fails_costs_no_results(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def fails(_: Path) -> Path:
        raise RuntimeError("no page today")

    monkeypatch.setattr("orchestrator.experiment.conduct.make_page", fails)
    outcome = ended(folder, page=True)
    assert (str(outcome.report_error), outcome.page) == ("no page today", None)
    assert [row["n"] for row in outcome.summary] == [4, 3, 4, 4]


def test_a_disk_that_is_full_is_no_bug_of_the_page(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write = Path.write_text

    def fails(path: Path, *text: Any, **how: Any) -> int:
        if path.name == "index.html":
            raise OSError(errno.ENOSPC, "No space left on device")
        return write(path, *text, **how)

    monkeypatch.setattr(Path, "write_text", fails)
    outcome = ended(folder, page=True)
    assert outcome.report_error is not None
    said = _report_failed(small(), outcome, outcome.report_error)
    assert said.exit_code is Exit.WRONG_INPUT
    page = folder / "index.html"
    assert f"the report cannot be made: `{page}`: No space left on device; the results" in said.text


DOCS = Path(__file__).parents[3] / "docs"


def test_the_commands_of_the_manual_work(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The tutorial runs the experiment; of the directories that are joined others are made here."""
    manual = (DOCS / "experiment-page.md").read_text()
    experiment, report = re.findall(r"^\$ nlosim (.*)$", manual, re.MULTILINE)
    assert f"$ nlosim {experiment}\n" in (DOCS / "tutorial.md").read_text()
    command, *directories, option, page = report.split()
    assert (command, option) == ("report", "--page")
    monkeypatch.chdir(tmp_path)
    for directory in directories:
        conducted(Path(directory), small(), became)
    assert main(report.split()) == 0
    assert len(data_of(Path(page))["about"]["parts"]) == 2
