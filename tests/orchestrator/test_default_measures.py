"""Measures that are asked of every run whose scenario does not speak of them."""

import json
from pathlib import Path

import pytest

from orchestrator import measure
from orchestrator.cli import main
from orchestrator.run import run_scenario
from orchestrator.scenario.build import load_scenario
from tests.installation import install
from tests.orchestrator.conftest import SAMPLE_UNITS


@pytest.fixture
def two(scenario_file: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A scenario of two units, where two measures are installed that are asked by default."""
    more = {"travel": "default_measures:Travel", "stillness": "default_measures:Stillness"}
    measures = SAMPLE_UNITS[measure.GROUP] | more
    install(monkeypatch, SAMPLE_UNITS | {measure.GROUP: measures})
    return scenario_file


def test_a_scenario_that_does_not_speak_of_measures_asks_those_that_have_an_answer(
    two: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """`travel` needs a signal that is there, `stillness` one that is not."""
    out = tmp_path / "out"
    assert main(["run", str(two), "--out", str(out)]) == 0
    text = capsys.readouterr().out
    metrics = json.loads((out / "metrics.json").read_text())
    assert list(metrics["measures"]) == ["travel"]
    assert metrics["measures_left_out"]["stillness"] == "not recorded: `car.vehicle.z`"
    assert "travel: metres " in text
    assert "left out: " in text
    assert "stillness (not recorded: `car.vehicle.z`)" in " ".join(text.split())
    first = (out / "metrics.json").read_text()
    assert main(["report", str(out)]) == 0
    assert (out / "metrics.json").read_text() == first


def test_no_measures_are_asked_of_who_wants_none(
    two: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    assert main(["run", str(two), "--set", "measures={}", "--out", str(out)]) == 0
    assert json.loads((out / "metrics.json").read_text()) == {}
    assert load_scenario(two, ["measures={}"]).resolved()["measures"] == {}
    assert main(["report", str(out)]) == 2
    assert "`--measures all` asks them anyway" in " ".join(capsys.readouterr().err.split())
    assert main(["report", str(out), "--measures", "all"]) == 0
    assert list(json.loads((out / "metrics.json").read_text())["measures"]) == ["travel"]
    assert main(["report", str(out), "--measures", "travel"]) == 0
    assert set(json.loads((out / "metrics.json").read_text())) == {"measures"}
    assert main(["report", str(out), "--measures", "travle"]) == 2
    error = " ".join(capsys.readouterr().err.split())
    assert "no measure `travle` can be asked; did you mean `travel`?" in error


def test_a_run_from_python_asks_what_the_scenario_names(two: Path, tmp_path: Path) -> None:
    outcome = run_scenario(load_scenario(two), tmp_path / "a", figure=False)
    assert outcome.metrics == {}
    outcome = run_scenario(load_scenario(two), tmp_path / "b", figure=False, default_measures=True)
    assert list(outcome.metrics["measures"]) == ["travel"]
