"""`nlosim run`: exit codes, one JSON object, and a run directory that says what happened."""

import importlib
import json
import os
import re
import signal
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from orchestrator.cli import main
from orchestrator.recording.reader import Recording


def read(path: Path) -> dict[str, Any]:
    content: dict[str, Any] = json.loads(path.read_text())
    return content


def test_a_run_leaves_a_directory_that_explains_itself(
    scenario_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    arguments = ["run", str(scenario_file), "--out", str(out), "--set", "report=trace"]
    assert main([*arguments, "--seed", "3"]) == 0
    text = capsys.readouterr().out
    assert "Two units: 21 samples" in text
    manifest = read(out / "manifest.json")
    assert f"fingerprint  {manifest['fingerprint']}" in text
    assert f"recorded in  {out}" in text
    assert manifest["status"] == "done"
    assert manifest["seed"] == manifest["scenario"]["seed"] == 3
    assert manifest["overrides"] == ["report=trace", "seed=3"]
    assert manifest["scenario_file"] == str(scenario_file)
    assert {"nlosim", "python", "numpy"} <= set(manifest["versions"])
    assert set(manifest["wall_time_s"]["components"]) == {"car", "base"}
    assert manifest["wall_time_s"]["orchestrator"] >= 0
    metrics = read(out / "metrics.json")
    assert metrics["samples"] == 21
    assert (out / "figure.png").read_bytes().startswith(b"\x89PNG")
    assert f"running {scenario_file} with seed 3" in (out / "log.txt").read_text()
    assert Recording(out).fingerprint() == manifest["fingerprint"]


def test_json_is_one_object_with_the_fields_that_scripts_read(
    scenario_file: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    assert main(["run", str(scenario_file), "--out", str(out), "--json", "--quiet"]) == 0
    captured = capfd.readouterr()
    result = json.loads(captured.out)
    assert captured.err == ""
    assert re.fullmatch("[0-9a-f]{64}", result["fingerprint"])
    assert result["out"] == str(out)
    assert result["sim_seconds_per_wall_second"] > 0
    assert result["metrics"] == {}


def test_the_result_depends_on_the_seed_and_not_on_where_components_run(
    scenario_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    def fingerprint(name: str, *options: str) -> str:
        out = str(tmp_path / name)
        assert main(["run", str(scenario_file), "--out", out, "--json", "--quiet", *options]) == 0
        found: str = json.loads(capsys.readouterr().out)["fingerprint"]
        return found

    first = fingerprint("a")
    assert fingerprint("b") == first
    assert fingerprint("c", "--transport", "loopback") == first
    assert fingerprint("d", "--seed", "8") != first


def test_directories_are_numbered_and_never_overwritten(
    scenario_file: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.chdir(tmp_path)
    for _ in range(3):
        assert main(["run", str(scenario_file), "--quiet"]) == 0
    assert sorted(path.name for path in (tmp_path / "runs").iterdir()) == [
        "two-7",
        "two-7-2",
        "two-7-3",
    ]


def test_a_directory_with_something_in_it_is_refused(
    scenario_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["run", str(scenario_file), "--out", str(tmp_path)]) == 2
    assert f"`{tmp_path}` is not empty; choose another directory" in capsys.readouterr().err
    file = tmp_path / "file"
    file.write_text("")
    assert main(["run", str(scenario_file), "--out", str(file)]) == 2
    assert "cannot be created" in capsys.readouterr().err


def test_a_component_that_fails_ends_the_run_with_code_3_and_what_was_recorded(
    scenario_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    fails = "components.base.parameters.fails_at=300 ms"
    arguments = ["run", str(scenario_file), "--out", str(out), "--set", fails, "--json"]
    assert main([*arguments, "--set", "report=trace", "--quiet"]) == 3
    captured = capsys.readouterr()
    message = "component `base` at t = 0.3 s: RuntimeError: the antenna fell off"
    unit = Path(__file__).parent / "packages" / "sample_units.py"
    (number,) = [
        k
        for k, line in enumerate(unit.read_text().splitlines(), 1)
        if "the antenna fell off" in line
    ]
    where = f"{unit}:{number}, in step"
    log = out / "log.txt"
    assert captured.err == (
        f"error: {message}\nraised at {where}\ntraceback: {log}\nrecorded until then: {out}\n"
    )
    assert json.loads(captured.out)["error"] == {
        "raised_at": where,
        "kind": "component",
        "exit_code": 3,
        "message": message,
        "component": "base",
        "time_s": 0.3,
        "out": str(out),
    }
    assert read(out / "manifest.json")["status"] == "failed"
    assert "Traceback" in (out / "log.txt").read_text()
    assert read(out / "metrics.json")["samples"] == len(Recording(out)["car.vehicle.x"]) > 5


def test_a_report_that_fails_does_not_hide_why_the_run_failed(
    scenario_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    fails = "components.base.parameters.fails_at=300 ms"
    arguments = ["run", str(scenario_file), "--out", str(out), "--set", "report=buggy"]
    assert main([*arguments, "--set", fails]) == 3
    error = capsys.readouterr().err
    assert "the antenna fell off" in error
    assert "no such thing" not in error
    assert "no report of the truncated recording: NotAnsweredError" in (out / "log.txt").read_text()


def test_a_report_that_fails_on_a_complete_run_is_named_with_its_traceback_in_the_log(
    scenario_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    assert main(["run", str(scenario_file), "--out", str(out), "--set", "report=buggy"]) == 3
    error = capsys.readouterr().err
    assert "its report `buggy` failed: LookupError: no such thing" in error
    assert "sample_units.py:205, in metrics" in error
    assert f"traceback: {out / 'log.txt'}" in error
    assert "this is a bug" not in error
    assert "Traceback" not in error
    assert "Traceback" in (out / "log.txt").read_text()
    assert read(out / "manifest.json")["status"] == "done"


def test_an_interruption_ends_the_run_with_code_4_and_a_readable_recording(
    scenario_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    interrupts = "components.base.parameters.interrupts_at=300 ms"
    arguments = ["run", str(scenario_file), "--out", str(out), "--set", interrupts]
    assert main([*arguments, "--json"]) == 4
    captured = capsys.readouterr()
    assert json.loads(captured.out)["error"]["kind"] == "interrupted"
    assert captured.err == f"interrupted\nrecorded until then: {out}\n"
    assert read(out / "manifest.json")["status"] == "interrupted"
    assert len(Recording(out)["car.vehicle.x"]) > 5


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_stops_at_the_next_communication_point(
    number: signal.Signals,
    scenario_file: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The signal arrives in the middle of the step to 0.4 s; that step is still recorded."""
    sample_units = importlib.import_module("sample_units")
    original = sample_units.Receiver.step

    def step(self: Any, inputs: Any, t: int, h: int) -> None:
        if t == 300_000_000:
            os.kill(os.getpid(), number)
        original(self, inputs, t, h)

    monkeypatch.setattr(sample_units.Receiver, "step", step)
    handlers = [signal.getsignal(n) for n in (signal.SIGINT, signal.SIGTERM)]
    out = tmp_path / "out"
    assert main(["run", str(scenario_file), "--out", str(out)]) == 4
    assert "stopping at the next communication point" in capsys.readouterr().err
    assert read(out / "manifest.json")["reached_ns"] == 400_000_000
    assert int(np.asarray(Recording(out)["base.y"].times)[-1]) == 400_000_000
    assert [signal.getsignal(n) for n in (signal.SIGINT, signal.SIGTERM)] == handlers


def test_a_wrong_scenario_leaves_no_directory(
    scenario_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    assert (
        main(["run", str(scenario_file), "--out", str(out), "--set", "time.stop=0.33", "--json"])
        == 2
    )
    captured = capsys.readouterr()
    error = json.loads(captured.out)["error"]
    assert error["kind"] == "scenario"
    assert [problem["line"] for problem in error["problems"]] == [10, 14]
    assert "two.yaml:10:11: components.car.step: 50 ms does not divide" in captured.err
    assert not out.exists()


def test_an_unknown_transport_is_wrong_input(
    scenario_file: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["run", str(scenario_file), "--transport", "telepathy"]) == 2
    assert "no transport `telepathy` is installed; there are: " in capsys.readouterr().err


def test_warnings_are_shown_and_logged_unless_quiet(
    scenario_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    swap = ["--set", "components.car.type=receiver", "--set", "components.car.parameters.gain=1"]
    swap += ["--set", "connections=[]", "--set", "recording.include=[base.y]"]
    for name, options, is_shown in (("a", [], True), ("b", ["--quiet"], False)):
        out = tmp_path / name
        assert main(["run", str(scenario_file), "--out", str(out), *swap, *options]) == 0
        remark = "components.car.parameters.count: ignored, the type that was set has no `count`"
        assert (remark in capsys.readouterr().err) == is_shown
        assert remark in (out / "log.txt").read_text()
