"""`nlosim ssp import` and `export` as people call them."""

import json
from pathlib import Path

import pytest

from adapters.ssp_command import add_command
from orchestrator.cli import main
from orchestrator.cli.outcome import Exit, Outcome
from tests.adapters.ssp.packages import component, description, package, system
from tests.adapters.ssp.test_import import pair
from tests.commands import executed


def ssp(*words: str | Path) -> Outcome:
    return executed(add_command, "ssp", *map(str, words))


def test_import_says_what_to_do_next(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    path = package(tmp_path, description(pair()))
    monkeypatch.chdir(tmp_path)
    outcome = ssp("import", path.name, "--step", "1/50", "--stop-time", "5")
    assert outcome.exit_code is Exit.NOT_PASSED  # its FMU has no binaries
    lines = outcome.text.splitlines()
    assert lines[:2] == ["test/test.yaml: 2 components, 1 connections", "it cannot run as it is:"]
    assert outcome.data["scenario"] == "test/test.yaml"
    assert [each["line"] for each in outcome.data["obstacles"]] == [3, 4]
    assert "components.a.fmu: resources/plant.fmu: cannot run" in outcome.text
    text = Path("test/test.yaml").read_text()
    assert "step: 20 ms  # as asked for" in text
    assert "time: {start: 0 s, stop: 5 s}  # as asked for" in text
    assert main(["check", "test/test.yaml"]) == Exit.WRONG_INPUT
    assert "it has no binaries" in capsys.readouterr().out
    outcome = ssp("import", path.name)
    assert outcome.exit_code is Exit.WRONG_INPUT
    assert "choose another folder with `-o`" in outcome.text


def test_an_empty_folder_is_filled(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = package(tmp_path, description(pair()))
    (tmp_path / "empty").mkdir()
    monkeypatch.chdir(tmp_path / "empty")
    assert ssp("import", path, "-o", ".").exit_code is Exit.NOT_PASSED
    assert sorted(each.name for each in Path().iterdir()) == ["resources", "test.yaml"]


def test_problems_are_printed_for_programs(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = package(tmp_path, description(pair(end="b.w")))
    out = str(tmp_path / "out")
    assert main(["ssp", "import", str(path), "-o", out, "--json"]) == Exit.WRONG_INPUT
    (found,) = json.loads(capsys.readouterr().out)["error"]["problems"]
    assert (found["file"], found["line"]) == ("test.ssp/SystemStructure.ssd", 6)


@pytest.mark.parametrize(
    ("words", "problem"),
    [
        (("--step", "x"), "expected a number, got `x`"),
        (("--step", "1/0"), "`1/0` divides by 0"),
        (("--stop-time", "inf"), "expected a finite number, got `inf`"),
        (("--system", "Hot"), "there is no variant `Hot`"),
    ],
)
def test_what_cannot_be_asked_for_is_told(
    tmp_path: Path, words: tuple[str, ...], problem: str
) -> None:
    path = package(tmp_path, description(pair()))
    outcome = ssp("import", path, "-o", tmp_path / "out", *words)
    assert outcome.exit_code is Exit.WRONG_INPUT
    assert problem in outcome.text
    assert not (tmp_path / "out").exists()


def test_a_package_is_no_scenario_and_nlosim_run_says_what_to_do(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = package(tmp_path, description(system("t", component("a"))))
    assert main(["run", str(path)]) == Exit.WRONG_INPUT
    assert "is an archive; `nlosim ssp import` makes a scenario" in capsys.readouterr().err


def test_a_scenario_that_is_wrong_is_not_exported(tmp_path: Path) -> None:
    path = tmp_path / "wrong.yaml"
    path.write_text(
        "schema: 1\ntitle: W\ntime: {stop: 1 s}\ncomponents: {a: {fmu: no.fmu, step: 1 s}}\n"
    )
    outcome = ssp("export", path, "-o", tmp_path / "wrong.ssp")
    assert outcome.exit_code is Exit.WRONG_INPUT
    assert f"{path}:4:" in outcome.text
    assert not (tmp_path / "wrong.ssp").exists()
