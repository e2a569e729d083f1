"""docs/resuming.md is true: its commands print what it shows, with other numbers."""

import re
from pathlib import Path

import pytest

from orchestrator.cli import main, run as run_command
from tests.orchestrator.resumable import Cut

PAGE = Path(__file__).parents[1] / "docs" / "resuming.md"
MS = 1_000_000


def numberless(text: str) -> str:
    """The text in one line, with `N` for each number."""
    return re.sub(r"\d+(\.\d+)?", "N", " ".join(text.split()))


@pytest.mark.slow
def test_the_commands_do_what_the_page_shows(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Of a run of 400 ms that is cut off behind 310 ms, with checkpoints every 100 ms."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(run_command, "progress_meter", lambda: Cut(310 * MS))
    found = 0
    for block in re.findall(r"^```console\n(.*?)^```$", PAGE.read_text(), re.DOTALL | re.MULTILINE):
        for command, expected in re.findall(
            r"^\$ nlosim (.*)\n((?:[^$].*\n)*)", block, re.MULTILINE
        ):
            words = command.replace("10s", "100ms").split()
            short = ["--set", "time.stop=400 ms", "--no-figure"] if words[0] == "run" else []
            assert main([*words, *short]) == (4 if short else 0)
            printed = "".join(reversed(capsys.readouterr()))  # what is said while it goes on, first
            for line in (part for part in expected.split("...\n") if part.strip()):
                assert numberless(line) in numberless(printed)
                found += 1
    assert found == 2
