"""Every scenario that ships is valid and runs."""

import json
from pathlib import Path
from typing import Any

import pytest

import scenarios
from orchestrator import simulation
from orchestrator.cli import main
from orchestrator.plan.plan import RunPlan, plan_of
from orchestrator.scenario.installed import installed, scenario_path

FILES = sorted(Path(scenarios.__file__).parent.glob("*.yaml"))


def test_there_are_scenarios() -> None:
    assert FILES


@pytest.mark.slow
@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_it_is_valid(path: Path) -> None:
    assert main(["check", str(path)]) == 0


def fingerprint(path: Path, out: Path) -> str:
    """That of 300 ms of a scenario."""
    assert main(["run", str(path), "--set", "time.stop=300 ms", "--out", str(out), "--quiet"]) == 0
    found: str = json.loads((out / "manifest.json").read_text(encoding="utf-8"))["fingerprint"]
    return found


@pytest.mark.slow
@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_it_runs_for_a_few_steps(
    path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """If compiled code steps some of its FMUs, it does what Python does."""
    plans: list[RunPlan | None] = []

    def noted(*given: Any, **more: Any) -> RunPlan | None:
        plans.append(plan_of(*given, **more))
        return plans[-1]

    monkeypatch.setattr(simulation, "plan_of", noted)
    found = fingerprint(path, tmp_path / "run")
    if any(plan is not None for plan in plans):
        monkeypatch.setattr(simulation, "plan_of", lambda *_, **__: None)
        assert fingerprint(path, tmp_path / "python") == found


def test_each_is_installed_under_its_name() -> None:
    assert [path.stem for path in FILES] == list(installed())
    assert [scenario_path(path.stem).resolve() for path in FILES] == FILES
