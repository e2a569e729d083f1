"""docs/rerun.md is true: its commands print what it shows, with other numbers."""

import re
from pathlib import Path

import pytest

from orchestrator.cli import main

PAGE = Path(__file__).parents[1] / "docs" / "rerun.md"


def numberless(text: str) -> str:
    """The text in one line, with `N` for each number and each fingerprint."""
    return re.sub(r"\b[0-9a-f]{64}\b", "N", " ".join(text.split()))


def test_the_commands_do_what_the_page_shows(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Of a run of 200 ms; the page's paths are relative, as its reader is in the parent folder."""
    monkeypatch.chdir(tmp_path)
    blocks = re.findall(r"^```console\n(.*?)^```$", PAGE.read_text(), re.DOTALL | re.MULTILINE)
    commands = re.findall(r"^\$ nlosim (.*)\n((?:[^$].*\n)*)", "".join(blocks), re.MULTILINE)
    assert [command.split()[0] for command, _ in commands] == ["run", "rerun"]
    for command, expected in commands:
        words = command.split()
        short = ["--set", "time.stop=200 ms", "--no-figure"] if words[0] == "run" else []
        assert main([*words, *short, "--quiet"]) == 0
        printed = numberless(capsys.readouterr().out)
        assert numberless(expected.replace("...\n", "")) in printed
