"""Measures: plug-ins with parameters that answer one question about any recording."""

import json
from pathlib import Path

import pytest

from orchestrator.cli import main
from orchestrator.errors import ScenarioError
from orchestrator.measure import measure_type
from orchestrator.recording.reader import Recording
from orchestrator.run import run_scenario
from orchestrator.scenario.build import load_scenario
from orchestrator.table_files import has_parquet
from tests.orchestrator.test_scenario_build import problems_of

SPAN = "measures={span: {signal: car.vehicle.x, scale: 50 cm}}"


def test_measures_stand_in_the_metrics_of_a_run_beside_those_of_its_report(
    scenario_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    arguments = ["run", str(scenario_file), "--set", SPAN, "--set", "report=trace"]
    assert main([*arguments, "--out", str(out), "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    metrics = json.loads((out / "metrics.json").read_text())
    assert answer["metrics"] == metrics
    assert metrics["distance_m"] > 0
    found = metrics["measures"]["span"]
    assert set(found) == {"span", "samples", "none"}
    assert found["none"] is None
    assert main(["run", str(scenario_file), "--set", SPAN, "--out", str(tmp_path / "alone")]) == 0
    line = f"span: span {found['span']:.6g}, samples {found['samples']}, none -"
    assert line in capsys.readouterr().out


def test_a_parameter_of_a_measure_has_its_unit(scenario_file: Path, tmp_path: Path) -> None:
    """Of half a metre there are twice as many as of a metre; one measure is asked twice."""
    measures = (
        "measures={half: {type: span, signal: car.vehicle.x, scale: 50 cm}, "
        "whole: {type: span, signal: car.vehicle.x}}"
    )
    assert main(["run", str(scenario_file), "--set", measures, "--out", str(tmp_path / "o")]) == 0
    found = json.loads((tmp_path / "o" / "metrics.json").read_text())["measures"]
    assert found["half"]["span"] == 2 * found["whole"]["span"] > 0


def test_measures_are_asked_again_by_report(
    scenario_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    assert main(["run", str(scenario_file), "--set", SPAN, "--out", str(out)]) == 0
    first = (out / "metrics.json").read_text()
    (out / "metrics.json").unlink()
    capsys.readouterr()
    assert main(["report", str(out)]) == 0
    assert (out / "metrics.json").read_text() == first
    text = capsys.readouterr().out
    assert text.startswith("span: span ")
    assert "figure.png" not in text


def test_a_resolved_scenario_has_the_same_measures(scenario_file: Path, tmp_path: Path) -> None:
    first = load_scenario(scenario_file, [SPAN])
    again = tmp_path / "resolved.yaml"
    again.write_text(json.dumps(first.resolved()))
    assert load_scenario(again).measures == first.measures


@pytest.mark.parametrize(
    ("measures", "message"),
    [
        ("{spam: {}}", "measures.spam: no measure `spam` is installed; did you mean `span`"),
        ("{a: {type: spam}}", ":22: measures.a.type: no measure `spam` is installed; did you mean"),
        ("{no-measure: }", "measures.no-measure: the measure `no-measure` is not a class derived"),
        ("{span: {}}", "measures.span: the parameter `signal` is missing: text"),
        (
            "{span: {signal: car.x, scal: 1}}",
            "measures.span.scal: there is no parameter `scal`; did you mean `scale`?",
        ),
        ("{span: {signal: car.x, scale: 1 s}}", "expected a length (m), got a time"),
        ("{span: {signal: bus.x}}", ":27: measures.span.signal: `bus.x` is of no component"),
    ],
)
def test_what_is_wrong_with_a_measure_is_located(
    scenario_file: Path, measures: str, message: str
) -> None:
    title = "title: Two units"
    found = problems_of(scenario_file, (title, f"{title}\nmeasures: {measures}"))
    assert any(message in problem and "yaml:3:" in problem for problem in found), found
    with pytest.raises(ScenarioError):
        load_scenario(scenario_file)


SEVERAL = (
    "measures={clumsy: {}, leaves: {type: leaving}, span: {signal: car.vehicle.x}, "
    "way: {type: course, signal: car.vehicle.x}}"
)


def test_measures_that_fail_are_named_and_take_nothing_of_the_others_along(
    scenario_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Two of four fail, one by ending the process; `run` and `report` say the same of them."""
    out = tmp_path / "out"
    failed = (
        "measure `clumsy` failed: LookupError: no such number; "
        "measure `leaves` failed: SystemExit: 0"
    )
    assert main(["run", str(scenario_file), "--set", SEVERAL, "--out", str(out)]) == 3
    error = capsys.readouterr().err
    assert f"error: the run is complete; its {failed}\nraised at " in error
    assert "sample_units.py:" in error
    assert f"traceback: {out / 'log.txt'}\nrecorded in: {out}" in error
    assert "LookupError: no such number" in (out / "log.txt").read_text()
    assert json.loads((out / "manifest.json").read_text())["status"] == "done"
    for _ in range(2):
        metrics = json.loads((out / "metrics.json").read_text())
        assert set(metrics["measures"]) == {"span", "way"}
        assert metrics["measures"]["span"]["span"] > 0
        assert metrics["measures_left_out"] == {
            "clumsy": "failed: LookupError: no such number",
            "leaves": "failed: SystemExit: 0",
        }
        assert (out / "measures" / "way-values.csv").is_file()
        assert (out / "measures.svg").is_file()
        (out / "measures.svg").unlink()
        (out / "metrics.json").unlink()
        (out / "measures" / "way-values.csv").unlink()
        assert main(["report", str(out), "--json"]) == 3
        found = json.loads(capsys.readouterr().out)["error"]
        assert (found["kind"], found["message"].partition("; what the others")[0]) == (
            "plugin",
            failed,
        )
        assert "LookupError: no such number" in Path(found["log"]).read_text()
        Path(found["log"]).unlink()


def test_a_measure_that_says_why_it_has_no_answer_is_no_defect(
    scenario_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """`span` of a signal that is not there: a recording says so, exit code 2."""
    out = tmp_path / "out"
    lacking = "measures={span: {signal: car.nothing}}"
    assert main(["run", str(scenario_file), "--set", lacking, "--out", str(out)]) == 2
    assert "its measure `span` failed: " in capsys.readouterr().err
    assert main(["report", str(out)]) == 2
    error = " ".join(capsys.readouterr().err.split())
    assert "measure `span` failed: " in error
    assert f"what the others found is in {out / 'metrics.json'}" in error


def test_measures_are_listed_and_described(
    scenario_file: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["components"]) == 0
    text = capsys.readouterr().out
    assert "measures:\n" in text
    assert "span        Between the least and the greatest value of a signal." in text
    assert main(["components", "span"]) == 0
    text = " ".join(capsys.readouterr().out.split())
    assert "scale number = 1 m >= 0.001 what one is" in text


def test_a_measure_that_finds_no_number_is_named(
    scenario_file: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    kind = measure_type("span")
    monkeypatch.setattr(kind, "compute", lambda self, recording: {"span": float("nan")})
    assert main(["run", str(scenario_file), "--set", SPAN, "--out", str(tmp_path / "out")]) == 3
    error = " ".join(capsys.readouterr().err.split())
    assert "its measure `span` failed: ArithmeticError: `span` is nan; `None` is for" in error


def test_metrics_without_measures_do_not_speak_of_them(scenario_file: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    assert main(["run", str(scenario_file), "--set", "report=trace", "--out", str(out)]) == 0
    assert "measures" not in json.loads((out / "metrics.json").read_text())


COURSE = "measures={way: {type: course, signal: car.vehicle.x}}"


def test_a_measure_leaves_tables_and_a_panel(
    scenario_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    assert main(["run", str(scenario_file), "--set", COURSE, "--out", str(out)]) == 0
    found = json.loads((out / "metrics.json").read_text())["measures"]["way"]
    header, first, *others = (out / "measures" / "way-values.csv").read_text().splitlines()
    assert (header, first) == ("time_ns,value", "0,")
    values = Recording(out)["car.vehicle.x"]
    assert others == [
        f"{time},{value!r}"
        for time, value in zip(values.times.tolist()[1:], values.values.tolist()[1:], strict=True)
    ]
    assert found == {"samples": len(others) + 1}
    drawn = (out / "measures.svg").read_bytes()
    capsys.readouterr()
    assert main(["report", str(out)]) == 0
    tables = ["measures/way-values.csv", "measures/way-values.parquet"][: 1 + has_parquet()]
    names = ("metrics.json", *tables, "measures.svg", "index.html")
    said = " ".join(capsys.readouterr().out.split())
    assert f"wrote {', '.join(str(out / name) for name in names)}" in said
    assert (out / "measures.svg").read_bytes() == drawn


def test_nothing_is_drawn_where_no_figure_is_wanted(scenario_file: Path, tmp_path: Path) -> None:
    scenario = load_scenario(scenario_file, [COURSE])
    run_scenario(scenario, tmp_path / "out", figure=False)
    assert (tmp_path / "out" / "measures" / "way-values.csv").is_file()
    assert not (tmp_path / "out" / "measures.svg").exists()


def test_the_page_is_there_and_made_again_in_equal_bytes(
    scenario_file: Path, tmp_path: Path
) -> None:
    out = tmp_path / "out"
    assert main(["run", str(scenario_file), "--set", COURSE, "--out", str(out)]) == 0
    drawn = {path.name: path.read_bytes() for path in out.glob("measures.*")}
    assert set(drawn) == {"measures.svg"}
    assert b"<svg" in drawn["measures.svg"]
    assert main(["report", str(out)]) == 0
    assert {path.name: path.read_bytes() for path in out.glob("measures.*")} == drawn
