"""Experiments over scenarios without encounter, roles or report: of measures and signals."""

from pathlib import Path

import numpy as np
import pytest

from orchestrator import tables_of
from orchestrator.campaign import workers
from orchestrator.cli import main
from orchestrator.errors import ScenarioError
from orchestrator.experiment.load import load_experiment
from orchestrator.experiment.tables import units
from tests.orchestrator.files import change
from tests.workers import workers_here

ROOT = Path(__file__).parents[3]
SHIPPED = ROOT / "studies" / "measures" / "experiments" / "city_equipment.yaml"


def test_the_metrics_say_which_measures_are_asked() -> None:
    (first, *others) = load_experiment(SHIPPED).combinations
    asked = [item for item in first.overrides if item.startswith("measures.")]
    names = ("prr", "awareness", "cbr", "hidden")
    assert asked == [f"measures.{name}={{}}" for name in names]
    assert len(others) == 2
    assert sorted(first.resolved["measures"]) == ["awareness", "cbr", "hidden", "prr"]
    assert "report" not in first.resolved


@pytest.mark.slow
def test_it_runs_and_more_radios_make_more_hidden_road_users_known(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Two seconds of a twentieth of the traffic; shares of radios, and of those known, ascend."""
    pytest.importorskip("pyarrow")
    pytest.importorskip("distributed")
    monkeypatch.setattr(workers, "local_workers", workers_here)
    text = SHIPPED.read_text().replace("../../../scenarios", str(ROOT / "scenarios"))
    text = text.replace(
        "time.stop: 20 s", "time.stop: 2 s, components.traffic.parameters.scale: 0.1"
    )
    file = tmp_path / "small.yaml"
    file.write_text(text)
    out = tmp_path / "out"
    arguments = ["experiment", str(file), "--seeds", "1", "--quiet"]
    assert main([*arguments, "--out", str(out)]) == 0
    tables = tables_of(out)
    assert set(tables) == {"runs", "summary"}
    summary = tables["summary"]
    assert summary["radios"].tolist() == ["25 %", "50 %", "100 %"]
    known = summary["hidden_known"].tolist()
    assert known == sorted(known)
    assert 0 < known[0] < known[-1] <= 1
    assert ((summary["prr"] > 0) & (summary["prr"] < 1) & (summary["cbr"] > 0)).all()
    assert sorted(tables["runs"]["prr"]) == sorted(summary["prr"])


def test_a_metric_of_a_measure_that_nobody_has_is_refused(tmp_path: Path) -> None:
    text = SHIPPED.read_text().replace("../../../scenarios", str(ROOT / "scenarios"))
    file = tmp_path / "wrong.yaml"
    for metric in ("measures.prr.prr", "measures.awareness.nar", "measures.cbr.cbr_mean"):
        text = text.replace(metric, metric.replace("measures.", "measures.no_"))
    text = text.replace("measures.hidden.", "measures.no_hidden.")
    file.write_text(text)
    with pytest.raises(Exception, match="no `report` and no `measures`: its runs have no metrics"):
        load_experiment(file)


PLAYED = """\
schema: 1
title: A table that is played
time: {stop: 1 s}
components:
  source: {type: table-source, step: 100 ms, parameters: {file: in.csv}}
"""
OF_SIGNALS = """\
schema: 1
scenario: play.yaml
seeds: 1
factors:
  between:
    held: {components.source.parameters.interpolation: hold}
    straight: {components.source.parameters.interpolation: linear}
metrics:
  mean: {signal: source.height, statistic: mean}
  above: {signal: source.height, statistic: time-of-first, condition: "> 2"}
  apart: {signal: source.height, statistic: rms-error, reference: in.csv, column: height}
  rows: measures.signals.rows
"""


@pytest.fixture
def of_signals(tmp_path: Path) -> Path:
    (tmp_path / "in.csv").write_text("time [s],height [m]\n0,0\n0.5,4\n1,4\n")
    (tmp_path / "play.yaml").write_text(PLAYED)
    path = tmp_path / "signals.yaml"
    path.write_text(OF_SIGNALS)
    return path


def test_metrics_of_signals_need_no_word_in_the_scenario(
    of_signals: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """A rise to 4 m in 0.5 s: held, 0 until then; straight, 0.8 m more in each step of 0.1 s."""
    parquet = pytest.importorskip("pyarrow.parquet")
    pytest.importorskip("distributed")
    monkeypatch.setattr(workers, "local_workers", workers_here)
    out = tmp_path / "out"
    arguments = ["experiment", str(of_signals), "--quiet", "--out", str(out)]
    assert main(arguments) == 0
    said = capsys.readouterr().out
    assert " ".join(said.splitlines()[0].split()) == "between n mean [m] above [s] apart [m] rows"
    summary = tables_of(out)["summary"]
    assert list(summary)[:6] == [
        "between",
        "n",
        "mean [m]",
        "mean_low [m]",
        "mean_high [m]",
        "mean_n",
    ]
    assert summary["between"].tolist() == ["held", "straight"]
    np.testing.assert_allclose(summary["mean [m]"], [2.0, 0.1 * (0.8 + 1.6 + 2.4 + 3.2) + 2.0])
    np.testing.assert_allclose(summary["above [s]"], [0.5, 0.3])
    apart = 0.8 * np.array([0, 1, 2, 3, 4, 0, 0, 0, 0, 0, 0])
    np.testing.assert_allclose(summary["apart [m]"], [np.sqrt(np.mean(apart**2)), 0.0], atol=1e-15)
    assert summary["rows"].tolist() == [11.0, 11.0]
    schema = parquet.read_schema(out / "runs.parquet")
    assert schema.field("above").metadata == {b"unit": b"s"}
    assert schema.field("rows").metadata is None


@pytest.mark.parametrize(
    ("old", "new", "place", "what"),
    [
        (
            "source.height, statistic: mean",
            "source.hight",
            (9, 18),
            "did you mean `source.height`?",
        ),
        ("statistic: mean", "statistik: mean", (9, 33), "did you mean `statistic`?"),
        (
            "mean: {signal: source.height, statistic: mean}",
            "mean: 3",
            (9, 9),
            "expected a path in",
        ),
        ('"> 2"', '"> 2 s"', (10, 71), "expected a length (m), got a time (s)"),
        (', condition: "> 2"', "", (10, 3), "`time-of-first` needs a `condition`"),
    ],
)
def test_mistakes_in_metrics_of_signals_have_their_place(
    of_signals: Path, old: str, new: str, place: tuple[int, int], what: str
) -> None:
    change(of_signals, (old, new))
    with pytest.raises(ScenarioError) as error:
        load_experiment(of_signals)
    (problem,) = error.value.problems
    assert what in problem.what
    assert problem.where.file == str(of_signals)
    assert (problem.where.line, problem.where.column) == place


def test_a_metric_of_a_signal_has_a_name_of_its_own(of_signals: Path) -> None:
    scenario = of_signals.with_name("play.yaml")
    scenario.write_text(PLAYED + "measures: {mean: {type: signal, signal: source.height}}\n")
    with pytest.raises(ScenarioError, match="the scenario has a measure `mean`; choose another"):
        load_experiment(of_signals)


def test_a_metric_has_the_unit_that_all_runs_say(of_signals: Path) -> None:
    """Runs that failed say nothing; `1` is none; where runs differ, there is none."""
    experiment = load_experiment(of_signals)

    def run(mean: str, above: str) -> dict[str, object]:
        said = {"mean": mean, "above": above}
        return {"measures": {name: {"value": 1.0, "unit": unit} for name, unit in said.items()}}

    assert units(experiment, [run("m", "s"), {}, run("m", "s")]) == {"mean": "m", "above": "s"}
    assert units(experiment, [run("m", "s"), run("km", "s")]) == {"above": "s"}
    assert units(experiment, [run("1", "s")]) == {"above": "s"}
