"""Every scenario that ships is valid and runs."""

from pathlib import Path

import pytest

import scenarios
from orchestrator.cli import main
from orchestrator.scenario.installed import installed, scenario_path

FILES = sorted(Path(scenarios.__file__).parent.glob("*.yaml"))


def test_there_are_scenarios() -> None:
    assert FILES


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_it_is_valid(path: Path) -> None:
    assert main(["check", str(path)]) == 0


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_it_runs_for_a_few_steps(path: Path, tmp_path: Path) -> None:
    out = tmp_path / "run"
    assert main(["run", str(path), "--set", "time.stop=300 ms", "--out", str(out), "--quiet"]) == 0
    assert (out / "manifest.json").is_file()


def test_each_is_installed_under_its_name() -> None:
    assert [path.stem for path in FILES] == list(installed())
    assert [scenario_path(path.stem).resolve() for path in FILES] == FILES
