"""Two simulations of SUMO in one run: what the error advises is what helps."""

import json
from pathlib import Path

import pytest

import scenarios
from orchestrator.cli import main

SCENE = Path(scenarios.__file__).parent / "assets" / "red_light" / "red_light.sumocfg"
TEXT = f"""\
schema: 1
title: Two streets
time: {{stop: 1 s}}
components:
  here:
    type: sumo-traffic
    step: 100 ms
    parameters: {{scene: {SCENE}}}
  there:
    type: sumo-traffic
    step: 100 ms
    process: true
    parameters: {{scene: {SCENE}}}
"""


@pytest.fixture
def two(tmp_path: Path) -> Path:
    path = tmp_path / "two.yaml"
    path.write_text(TEXT)
    return path


def test_one_process_is_not_enough_and_the_error_says_what_is(
    two: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["run", str(two), "--out", str(tmp_path / "run"), "--quiet"]) == 3
    said = capsys.readouterr().err
    assert "component `there` at t = 0 s: SUMO can run once per process" in said
    assert "`program: sumo`; or mark them `process: true` and run with `--transport local`" in said


@pytest.mark.parametrize(
    "advice",
    [("--transport", "local"), ("--set", "components.there.parameters.program=sumo")],
    ids=["transport", "program"],
)
def test_what_it_advises_helps(
    two: Path, tmp_path: Path, advice: tuple[str, str], capsys: pytest.CaptureFixture[str]
) -> None:
    """Both simulate the same street with the same seed of their own name."""
    assert main(["run", str(two), "--out", str(tmp_path / "run"), "--json", *advice]) == 0
    assert json.loads(capsys.readouterr().out)["simulated_s"] == 1.0


def test_check_says_when_the_mark_takes_effect(
    two: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["check", str(two)]) == 0
    assert capsys.readouterr().out.splitlines()[-2:] == [
        f"{two}: ok, 2 components, 0 connections",
        (
            f"{two}:12:5: `there`: `process: true` takes effect with `nlosim run --transport "
            "local` (or `zenoh`); without it they run in the orchestrator's process"
        ),
    ]
