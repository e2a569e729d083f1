"""An experiment over a scenario without encounter, roles or report, with metrics of measures."""

from pathlib import Path

import pytest

from orchestrator import tables_of
from orchestrator.cli import main
from orchestrator.experiment.load import load_experiment

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
def test_it_runs_and_more_radios_make_more_hidden_road_users_known(tmp_path: Path) -> None:
    """Two seconds of a twentieth of the traffic; shares of radios, and of those known, ascend."""
    pytest.importorskip("pyarrow")
    text = SHIPPED.read_text().replace("../../../scenarios", str(ROOT / "scenarios"))
    text = text.replace(
        "time.stop: 20 s", "time.stop: 2 s, components.traffic.parameters.scale: 0.1"
    )
    file = tmp_path / "small.yaml"
    file.write_text(text)
    out = tmp_path / "out"
    arguments = ["experiment", str(file), "--seeds", "1", "--workers", "2", "--quiet"]
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
