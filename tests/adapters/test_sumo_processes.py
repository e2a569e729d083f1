"""SUMO is in a process once: a second one is refused before the run."""

import json
from pathlib import Path

import pytest

from orchestrator.cli import main

SCENE = Path(__file__).parents[2] / "scenarios" / "assets" / "red_light" / "red_light.sumocfg"
SCENARIO = f"""\
schema: 1
title: Two scenes
time: {{stop: 50 ms}}
components:
  one:
    type: sumo-traffic
    step: 50 ms
    parameters: {{scene: {SCENE}}}
  other:
    type: sumo-traffic
    step: 50 ms
    parameters: {{scene: {SCENE}}}
"""


@pytest.fixture
def path(tmp_path: Path) -> Path:
    file = tmp_path / "two.yaml"
    file.write_text(SCENARIO)
    return file


@pytest.mark.parametrize("command", ["check", "run"])
def test_the_second_is_refused_at_its_line(
    path: Path, capsys: pytest.CaptureFixture[str], command: str
) -> None:
    assert main([command, str(path)]) == 2
    captured = capsys.readouterr()
    assert (
        f"{path}:9:3: components.other: SUMO can be in a process once, and it is in `one`; write "
        "`process: true` here"
    ) in captured.out + captured.err


@pytest.mark.parametrize("key", ["program: sumo", "traci: 'localhost:8813'"])
def test_a_sumo_that_is_a_program_is_in_no_process_of_ours(path: Path, key: str) -> None:
    head, _, tail = SCENARIO.rpartition("}")
    path.write_text(f"{head}, {key}}}{tail}")
    assert main(["check", str(path)]) == 0


@pytest.mark.parametrize(
    "advice",
    [(), ("--set", "components.other.parameters.program=sumo", "--transport", "in-process")],
    ids=["mark", "program"],
)
def test_what_it_advises_helps(
    path: Path, tmp_path: Path, advice: tuple[str, ...], capsys: pytest.CaptureFixture[str]
) -> None:
    """Both simulate the same street with the same seed of their own name."""
    path.write_text(SCENARIO.replace("  other:", "  other:\n    process: true"))
    assert main(["run", str(path), "--out", str(tmp_path / "run"), "--json", *advice]) == 0
    assert json.loads(capsys.readouterr().out)["simulated_s"] == 0.05
