"""Communication steps of a fraction of a second, from the scenario to the FMU and the recording."""

import json
import math
from pathlib import Path

import numpy as np
import pytest

from orchestrator.cli import main
from orchestrator.recording.reader import Recording

SCENARIO = """\
schema: 1
title: A lag at 60 Hz behind one at 30 Hz
time: {stop: 1 s}
components:
  quick: {fmu: lag2.fmu, step: 1/60 s, parameters: {time_constant: 0.5}}
  slow: {fmu: lag2.fmu, step: 1/30 s, parameters: {time_constant: 0.5, start.u: 3}}
connections:
  - {from: slow.x, to: quick.u}
"""


@pytest.fixture
def path(lag2: Path, tmp_path: Path) -> Path:
    (tmp_path / "lag2.fmu").write_bytes(lag2.read_bytes())
    file = tmp_path / "lags.yaml"
    file.write_text(SCENARIO)
    return file


def ran(path: Path, out: Path, *options: str) -> Recording:
    assert main(["run", str(path), "--no-figure", "--out", str(out), "--quiet", *options]) == 0
    return Recording(out)


def test_points_are_exact_and_values_those_of_exact_steps(path: Path, tmp_path: Path) -> None:
    run = ran(path, tmp_path / "run")
    quick, slow = run["quick.x"], run["slow.x"]
    assert list(quick.times[:4]) == [0, 16_666_667, 33_333_333, 50_000_000]
    assert (len(quick.times), quick.times[-1]) == (61, 10**9)
    assert list(slow.times) == list(quick.times[::2])
    exact = [3 - 2 * math.exp(-k / 15) for k in range(31)]
    np.testing.assert_allclose(np.asarray(slow.values), exact, rtol=1e-14)


def test_elsewhere_and_from_the_manifest_it_is_the_same(path: Path, tmp_path: Path) -> None:
    here = ran(path, tmp_path / "here")
    processes = ("--set", "components.quick.process=true", "--transport", "loopback")
    there = ran(path, tmp_path / "there", *processes)
    document = json.loads((tmp_path / "here" / "manifest.json").read_text())["scenario"]
    assert document["components"]["quick"]["step"] == "1/60 s"
    again = tmp_path / "again.yaml"
    again.write_text(json.dumps(document))
    assert there.fingerprint() == here.fingerprint()
    assert ran(again, tmp_path / "again").fingerprint() == here.fingerprint()


def test_the_graph_says_how_old_values_are(path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["graph", str(path), "--json"]) == 0
    graph = json.loads(capsys.readouterr().out)
    assert [node["step"] for node in graph["components"]] == ["1/30 s", "1/60 s"]
    assert graph["components"][1]["step_ns"] == 1e9 / 60
    assert main(["graph", str(path), "--set", "coupling.algorithm=jacobi"]) == 0
    assert "1/60 s to 1/30 s" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("written", "message"),
    [
        ("1/7 s", ""),
        ("1/60", "`1/60` has no unit; write `1/60 s`"),
        ("1/0 s", "`1/0 s` divides by zero"),
        ("1/9 ns", "`1/9 ns` is shorter than a nanosecond"),
        ("0/60 s", "must be longer than 0 s, got 0 s"),
        ("1/60 kg", "expected a time (s), got a mass (kg)"),
        ("16.6666667 ms", "16.6666667 ms is not a whole number of nanoseconds; write a step "),
        ("2/7 s", "2/7 s does not divide the simulated 1 s (1/7 s are left over)"),
    ],
)
def test_what_does_not_fit_is_refused_at_its_line(
    path: Path, capsys: pytest.CaptureFixture[str], written: str, message: str
) -> None:
    path.write_text(SCENARIO.replace("1/30 s", written))
    assert main(["check", str(path)]) == (2 if message else 0)
    assert f"6:31: components.slow.step: {message}" in capsys.readouterr().out or not message
