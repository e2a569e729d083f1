"""Scenarios of installed packages: found by name, listed, copied."""

import json
import os
from importlib.metadata import EntryPoint
from pathlib import Path

import pytest

from orchestrator.cli import main
from orchestrator.errors import ScenarioError
from orchestrator.experiment.load import load_experiment
from orchestrator.scenario import installed
from orchestrator.scenario.build import load_scenario
from orchestrator.scenario.installed import NoSuchScenarioError, scenario_beside, scenario_path

NUMBERS = iter(range(100))


def package(folder: Path, files: dict[str, str]) -> str:
    """A package of a name that no test has used, with `files`, and importable."""
    name = f"shipped_{next(NUMBERS):03}"
    for file, text in {"__init__.py": "", **files}.items():
        path = folder / name / file
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    return name


@pytest.fixture
def install(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    """A folder in which to make packages; see `offer`."""
    monkeypatch.syspath_prepend(tmp_path / "site")
    monkeypatch.chdir(tmp_path)
    return tmp_path / "site"


def offer(monkeypatch: pytest.MonkeyPatch, *packages: str) -> None:
    """Install exactly the scenarios of `packages`."""
    entries = [EntryPoint(name, name, installed.SCENARIOS) for name in packages]
    monkeypatch.setattr(installed, "entry_points", lambda group: entries)


@pytest.fixture
def crossing(install: Path, scenario_file: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An installed scenario `crossing`, `crossing_wet` which extends it, and one that is broken."""
    files = {
        "crossing.yaml": scenario_file.read_text(),
        "crossing_wet.yaml": "schema: 1\nextends: crossing.yaml\ntitle: Wet crossing\n",
        "broken.yaml": "title: [",
        "assets/net.xml": "<net/>",
    }
    name = package(install, files)
    offer(monkeypatch, name)
    return install / name


def test_a_name_means_the_installed_scenario(crossing: Path, tmp_path: Path) -> None:
    assert scenario_path("crossing") == crossing / "crossing.yaml"
    assert main(["check", "crossing_wet"]) == 0
    assert main(["graph", "crossing"]) == 0
    assert main(["run", "crossing", "--quiet"]) == 0
    assert (tmp_path / "runs" / "crossing-7" / "manifest.json").is_file()


def test_an_existing_file_wins(crossing: Path) -> None:
    Path("crossing").write_text("mine")
    assert scenario_path("crossing") == Path("crossing")


@pytest.mark.parametrize("given", ["no/crossing", "crossing.yaml", "./crossing", "crossing.yml"])
def test_what_looks_like_a_path_is_one(crossing: Path, given: str) -> None:
    assert scenario_path(given) == Path(given)


def test_a_folder_is_no_file(crossing: Path) -> None:
    Path("crossing").mkdir()
    assert scenario_path("crossing") == crossing / "crossing.yaml"


def test_what_is_there_and_no_file_is_said_to_be_that(
    crossing: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("folder").mkdir()
    assert main(["check", "folder"]) == 2
    assert capsys.readouterr().out == "folder:1:1: cannot be read: it is a directory, not a file\n"


def test_an_unknown_name_has_suggestions(
    crossing: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    message = (
        "there is no file `crosing`, and no scenario of that name is installed; "
        "did you mean `crossing`?"
    )
    for command in ("run", "check", "graph"):
        assert main([command, "crosing"]) == 2
        assert capsys.readouterr().err == f"error: {message}\n"
    assert main(["run", "crosing", "--json"]) == 2
    assert json.loads(capsys.readouterr().out)["error"]["message"] == message


@pytest.fixture
def elsewhere(tmp_path: Path) -> Path:
    folder = tmp_path / "elsewhere"
    folder.mkdir()
    return folder


def test_files_anywhere_build_on_an_installed_scenario(crossing: Path, elsewhere: Path) -> None:
    mine = elsewhere / "mine.yaml"
    mine.write_text("schema: 1\nextends: crossing_wet\ntitle: Mine\n")
    assert load_scenario(mine).title == "Mine"
    assert main(["run", str(mine), "--quiet", "--out", "once"]) == 0
    read = json.loads(Path("once/manifest.json").read_text())["scenario_files"]
    names = ("crossing.yaml", "crossing_wet.yaml")
    assert set(read) == {"mine.yaml", *(str(crossing / name) for name in names)}
    assert main(["rerun", "once", "--quiet"]) == 0
    experiment = elsewhere / "experiment.yaml"
    experiment.write_text(
        "schema: 1\nscenario: crossing\nseeds: 1\n"
        "set: {measures.span: {signal: car.x}}\nmetrics: {x: measures.span.x}\n"
    )
    assert load_experiment(experiment).scenario == crossing / "crossing.yaml"


def test_what_lies_beside_a_file_wins_over_what_is_installed(
    crossing: Path, elsewhere: Path
) -> None:
    (elsewhere / "crossing").mkdir()
    assert scenario_beside(elsewhere, "crossing") == crossing / "crossing.yaml"
    (elsewhere / "crossing").rmdir()
    (elsewhere / "crossing").write_text("mine")
    assert scenario_beside(elsewhere, "crossing") == elsewhere / "crossing"


@pytest.mark.parametrize("given", ["crossing.yaml", "./crossing", "no/crossing"])
def test_a_path_in_a_file_is_no_name(crossing: Path, elsewhere: Path, given: str) -> None:
    with pytest.raises(NoSuchScenarioError, match=r"the path is relative to this file\)$"):
        scenario_beside(elsewhere, given)


def test_a_name_in_a_file_that_nothing_has_is_told_at_its_place(
    crossing: Path, elsewhere: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    mine, experiment = elsewhere / "mine.yaml", elsewhere / "experiment.yaml"
    mine.write_text("schema: 1\nextends: crosing\n")
    experiment.write_text("schema: 1\nscenario: crosing\nseeds: 1\nmetrics: {x: measures.x}\n")
    what = (
        f"there is no file {elsewhere / 'crosing'} (the path is relative to this file), "
        "and no scenario of that name is installed; did you mean `crossing`?"
    )
    assert main(["check", str(mine)]) == 2
    assert capsys.readouterr().out == f"{mine}:2:10: extends: {what}\n"
    with pytest.raises(ScenarioError) as error:
        load_experiment(experiment)
    assert str(error.value) == f"{experiment}:2:11: scenario: {what}"


def test_nothing_is_installed(
    monkeypatch: pytest.MonkeyPatch, install: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    offer(monkeypatch)
    with pytest.raises(NoSuchScenarioError, match="is installed; there are none"):
        scenario_path("crossing")
    assert main(["scenarios"]) == 0
    assert capsys.readouterr().out == "no scenarios are installed\n"


def test_two_packages_with_one_name_are_told_apart_by_path(
    monkeypatch: pytest.MonkeyPatch, install: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    first, second = (package(install, {"city.yaml": "title: City"}) for _ in range(2))
    offer(monkeypatch, first, second)
    with pytest.raises(NoSuchScenarioError, match="several scenarios are called `city`") as error:
        scenario_path("city")
    assert all(str(install / name / "city.yaml") in str(error.value) for name in (first, second))
    assert main(["scenarios", "--json"]) == 0
    rows = json.loads(capsys.readouterr().out)["scenarios"]
    assert [row["package"] for row in rows] == [first, second]


def test_a_broken_package_takes_nothing_away(
    monkeypatch: pytest.MonkeyPatch, crossing: Path, caplog: pytest.LogCaptureFixture
) -> None:
    offer(monkeypatch, crossing.name, "no_such_package")
    assert "crossing" in installed.installed()
    assert "the scenarios of `no_such_package` cannot be listed" in caplog.text


def test_they_are_listed(crossing: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["scenarios"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].startswith("  broken        not usable: ")
    assert lines[1].split() == ["crossing", "Two", "units", str(crossing / "crossing.yaml")]
    assert main(["scenarios", "--json"]) == 0
    broken, dry, wet = json.loads(capsys.readouterr().out)["scenarios"]
    assert broken["title"] is None
    assert "broken.yaml" in broken["error"]
    assert (dry["name"], dry["title"], dry["error"]) == ("crossing", "Two units", None)
    assert wet == {
        "name": "crossing_wet",
        "title": "Wet crossing",
        "package": crossing.name,
        "path": str(crossing / "crossing_wet.yaml"),
        "error": None,
    }


def test_a_copy_has_all_that_it_needs(
    crossing: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "mine"
    assert main(["scenarios", "--copy", "crossing_wet", str(out), "--json"]) == 0
    copied = json.loads(capsys.readouterr().out)
    assert copied["path"] == str(out / "crossing_wet.yaml")
    assert {os.path.relpath(file, out) for file in copied["files"]} == {
        "crossing.yaml",
        "crossing_wet.yaml",
        "assets/net.xml",
    }
    assert main(["check", copied["path"]]) == 0


def test_a_copy_overwrites_nothing_that_differs(
    crossing: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = ["scenarios", "--copy", "crossing", str(tmp_path / "mine")]
    assert main(arguments) == 0
    assert main(arguments) == 0  # the same bytes again
    edited = tmp_path / "mine" / "crossing.yaml"
    edited.write_text("mine")
    capsys.readouterr()
    assert main(arguments) == 2
    assert f"`{edited}` is there already" in capsys.readouterr().err
    assert edited.read_text() == "mine"
    assert main(["scenarios", "--copy", "crosing", str(tmp_path)]) == 2
    assert "did you mean `crossing`?" in capsys.readouterr().err
