"""Compiled code steps FMUs between the steps of components elsewhere, whose steps are longer."""

from collections.abc import Callable
from pathlib import Path

import pytest

from orchestrator.algorithm.participant import Participant
from orchestrator.cli import main
from orchestrator.recording.reader import Recording

SCENARIO = """\
schema: 1
title: Three copies of one FMU, one of them in a process
time: {{stop: 200 ms}}
coupling: {{algorithm: {algorithm}}}
components:
  first: {{fmu: mirror.fmu, step: 1 ms}}
  away: {{fmu: mirror.fmu, step: 20 ms, process: true}}
  second: {{fmu: mirror.fmu, step: 2 ms}}
connections:
  - {{from: first.float64.out, to: away.float64.in, gain: 0.5}}
  - {{from: away.float64.out, to: first.float64.in, delay: 30 ms}}
  - {{from: away.int32.out, to: second.int32.in}}
  - {{from: first.copy, to: second.payload}}
"""


@pytest.fixture
def scenario(fmu: Callable[[str], Path], tmp_path: Path) -> Path:
    (tmp_path / "mirror.fmu").write_bytes(fmu("mirror").read_bytes())
    return tmp_path / "three.yaml"


@pytest.mark.parametrize(
    ("algorithm", "transport"),
    [("jacobi", "local"), ("gauss-seidel", "local"), ("jacobi", "loopback")],
)
def test_all_points_between_those_of_a_process_are_compiled(
    scenario: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    stretches: list[int],
    *,
    algorithm: str,
    transport: str,
) -> None:
    """`away` is due at 10 of 200 points; the 19 before each of them are one stretch."""
    order = ", order: [first, away, second]" if algorithm == "gauss-seidel" else ""
    scenario.write_text(SCENARIO.format(algorithm=algorithm + order))

    def fingerprint(name: str, *options: str) -> str:
        out = tmp_path / name
        assert (
            main(["run", str(scenario), "--no-figure", "--out", str(out), "--quiet", *options]) == 0
        )
        return str(Recording(out).manifest["fingerprint"])

    found = fingerprint("compiled", "--transport", transport)
    assert stretches == [19] * 10
    monkeypatch.setattr("orchestrator.plan.layouts.engine", lambda: None)
    assert fingerprint("python") == found
    assert stretches == [19] * 10


def test_outputs_that_are_renewed_stay_in_python(
    scenario: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, stretches: list[int]
) -> None:
    """By Jacobi; Gauss-Seidel renews nothing."""
    monkeypatch.setattr(Participant, "can_refresh", True)
    monkeypatch.setattr("orchestrator.algorithm.jacobi.has_feedthrough", lambda *_: True)
    for algorithm in ("jacobi", "gauss-seidel, order: [first, away, second]"):
        assert not stretches
        scenario.write_text(SCENARIO.format(algorithm=algorithm))
        assert (
            main(
                ["run", str(scenario), "--no-figure", "--out", str(tmp_path / algorithm), "--quiet"]
            )
            == 0
        )
    assert stretches
