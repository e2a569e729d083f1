"""docs/model-exchange.md is true: its scenario and its commands give what it shows."""

import re
import shlex
from pathlib import Path

import pytest

from orchestrator.cli import main
from orchestrator.recording.reader import Recording

PAGE = Path(__file__).parents[3] / "docs" / "model-exchange.md"


def blocks(kind: str) -> list[str]:
    return re.findall(rf"```{kind}\n(.*?)```", PAGE.read_text(), re.DOTALL)


@pytest.fixture
def folder(ball: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """With the files that the page names."""
    (tmp_path / "ball.fmu").write_bytes(ball.read_bytes())
    (scenario,) = blocks("yaml")
    (tmp_path / "ball.yaml").write_text(scenario)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_commands_show_what_the_page_shows(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    commands = [block.split("\n", 1) for block in blocks("text")]
    assert len(commands) == 2
    for command, shown in commands:
        assert main(shlex.split(command.removeprefix("$ nlosim "))) == 0
        assert capsys.readouterr().out == shown
    assert list(folder.iterdir())


def test_the_scenario_runs(folder: Path) -> None:
    """From 1.5 m, with a restitution of 0.8; energy is kept between bounces."""
    assert main(["run", "ball.yaml", "--quiet", "--out", "run"]) == 0
    run = Recording(folder / "run")
    energies = [float(run["ball.energy"].at(k * 50_000_000)) for k in range(21)]
    bounces = [int(run["ball.bounces"].at(k * 50_000_000)) for k in range(21)]
    assert bounces[-1] == 1
    for energy, count in zip(energies, bounces, strict=True):
        assert energy == pytest.approx(9.81 * 1.5 * 0.64**count, rel=1e-7)
