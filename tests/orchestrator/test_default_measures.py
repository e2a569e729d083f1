"""Measures that are asked of every run whose scenario does not speak of them."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typing_extensions import override

from orchestrator import findings, measure
from orchestrator.cli import main
from orchestrator.experiment.load import load_experiment
from orchestrator.run import run_scenario
from orchestrator.run_outcome import RunFailedError, RunInterrupted
from orchestrator.scenario.build import load_scenario
from orchestrator.signal import Signals
from orchestrator.timebase import Time
from tests.installation import install
from tests.orchestrator.conftest import SAMPLE_UNITS
from tests.orchestrator.resumable import Cut


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
    assert main(["report", str(out)]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "`--measures all` asks them anyway" in said
    assert f"wrote {out / 'metrics.json'}, {out / 'index.html'}" in said
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


def test_who_stops_a_run_does_not_wait_for_them(two: Path, tmp_path: Path) -> None:
    """They can be had later; what the scenario asks for is there, and is what it was."""
    for number, (more, asked) in enumerate({"": {}, "measures.way.type=travel": {"way"}}.items()):
        out = tmp_path / str(number)
        scenario = load_scenario(two, [more] if more else [])
        with pytest.raises(RunInterrupted):
            run_scenario(
                scenario, out, figure=False, default_measures=True, observers=[Cut(scenario.start)]
            )
        metrics = json.loads((out / "metrics.json").read_text())
        assert metrics.get("measures", {}).keys() == set(asked)
        assert main(["report", str(out)]) == 0
        later = json.loads((out / "metrics.json").read_text())["measures"]
        assert later.keys() == (asked or {"travel"})


class _Failing(Cut):
    """Ends a run as a component that fails does."""

    @override
    def observe(self, t: Time, published: tuple[str, ...], values: Mapping[str, Signals]) -> None:
        raise ValueError("enough")


def test_of_a_run_that_fails_they_are_what_they_can_be(two: Path, tmp_path: Path) -> None:
    scenario = load_scenario(two)
    with pytest.raises(RunFailedError, match="enough"):
        run_scenario(
            scenario, tmp_path / "out", figure=False, default_measures=True, observers=[_Failing(0)]
        )
    metrics = json.loads((tmp_path / "out" / "metrics.json").read_text())
    assert list(metrics["measures"]) == ["travel"]


def test_an_experiment_asks_the_measures_that_its_metrics_name(two: Path) -> None:
    """Of a scenario that asks none: once each, and none for what stands elsewhere."""
    two.with_name("experiment.yaml").write_text(
        f"""\
schema: 1
scenario: {two.name}
seeds: 1
set: {{report: trace}}
factors: {{power: {{low: {{components.car.parameters.power: 10 dBm}}}}}}
metrics:
  way: measures.travel.metres
  again: measures.travel.seconds
  distance: distance_m
  other: report.stillness.metres
  unknown: measures.course.metres
"""
    )
    (combination,) = load_experiment(two.with_name("experiment.yaml")).combinations
    asked = [each for each in combination.overrides if each.startswith("measures")]
    assert asked == ["measures.travel={}"]
    assert list(combination.resolved["measures"]) == ["travel"]


def test_an_experiment_asks_nothing_of_a_scenario_that_speaks_of_measures(two: Path) -> None:
    file = two.with_name("experiment.yaml")
    file.write_text(
        f"""\
schema: 1
scenario: {two.name}
seeds: 1
set: {{measures.way.type: travel}}
factors: {{power: {{low: {{components.car.parameters.power: 10 dBm}}}}}}
metrics: {{a: measures.travel.metres, b: measures.way.metres}}
"""
    )
    (combination,) = load_experiment(file).combinations
    assert list(combination.resolved["measures"]) == ["way"]


def test_the_terminal_has_the_first_numbers_that_there_are_of_measures_nobody_named() -> None:
    found = {
        "prr": {"is_whole": True, "low": None, "prr": 0.96, "b": 1, "c": 2, "d": 3, "e": 4},
        "silence": {"receptions": 0, "longest_s": None},
        "aoi": {"mean_ms": None, "is_whole": True},
        "delivery": {},
        "named": {"is_whole": True, "mean_s": None},
    }
    brief = found.keys() - {"named"}
    assert list(findings._lines({"measures": found}, brief, is_topic=True)) == [
        "prr: prr 0.96, b 1, c 2, d 3, ...",
        "silence: receptions 0",
        "named: is_whole True, mean_s -",
        "nothing to measure: aoi, delivery",
    ]


@pytest.mark.parametrize(
    ("found", "complaint"),
    [
        ([1, 2], "it gave `list`, not an `Answer` or a mapping"),
        ({"x": np.arange(2)}, "`x` is `ndarray`; numbers, texts, true, false"),
        ({"x": {"y": 1}}, "`x` is `dict`"),
    ],
)
def test_what_is_no_number_is_refused_by_its_name(found: Any, complaint: str) -> None:
    with pytest.raises(TypeError, match=complaint):
        findings._finite(found)


def test_numbers_of_numpy_are_numbers() -> None:
    given = {"a": np.int64(3), "b": np.float32(0.5), "c": np.bool_(True), "d": None, "e": "x"}
    plain = findings._finite(given)
    assert json.loads(json.dumps(plain)) == {"a": 3, "b": 0.5, "c": True, "d": None, "e": "x"}
    assert json.loads(json.dumps({"n": [np.int64(3)]}, default=findings._plain)) == {"n": [3]}
    with pytest.raises(TypeError, match=r"`ndarray` cannot stand in metrics.json"):
        json.dumps({"n": np.arange(2)}, default=findings._plain)
