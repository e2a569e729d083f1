"""The section on several hosts is true: its files and commands, in two terminals."""

import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from tests.adapters.hosting import free_port, until
from tests.test_tutorial import shown

ROOT = Path(__file__).parents[1]
PAGE = (ROOT / "docs" / "distribution.md").read_text()
SECTION = PAGE[PAGE.index("## Several hosts") : PAGE.index("## Once per process")]

pytest.importorskip("zenoh", reason="eclipse-zenoh is not installed")


@pytest.mark.slow
def test_two_terminals_show_what_the_page_shows(tmp_path: Path) -> None:
    port = str(free_port())
    blocks = re.findall(r"^```(\w+) ?(\S*)\n(.*?)^```$", SECTION, re.DOTALL | re.MULTILINE)
    for language, file, text in blocks:
        if language in ("yaml", "python"):
            (tmp_path / file).write_text(text.replace("7448", port))
    shells = [text.replace("7448", port) for language, _, text in blocks if language == "console"]
    serve, run, ending, here = shells

    def words(shell: str) -> tuple[list[str], str]:
        command, _, printed = shell.removeprefix("$ nlosim ").partition("\n")
        return [sys.executable, "-m", "orchestrator", *shlex.split(command)], printed

    def ran(shell: str) -> str:
        command, printed = words(shell)
        done = subprocess.run(
            command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False
        )
        assert done.returncode == 0, done.stderr
        assert shown(printed, done.stdout), done.stdout
        (fingerprint,) = re.findall(r"^fingerprint +(\w+)$", done.stdout, re.MULTILINE)
        return str(fingerprint)

    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    output = tmp_path / "serve.txt"
    command, ready = words(serve)
    with (
        output.open("w") as stream,
        subprocess.Popen(command, cwd=tmp_path, env=environment, stdout=stream) as serving,
    ):
        try:
            assert until(lambda: shown(ready, output.read_text()), 60)
            away = ran(run)
            assert serving.wait(60) == 0
        finally:
            serving.kill()
    assert shown(ready + ending, output.read_text()), output.read_text()
    assert ran(here) == away


def test_the_difference_that_the_page_shows_is_one_that_is_said() -> None:
    """Where the line is that it names."""
    scenario = re.findall(r"^```yaml loop.yaml\n(.*?)^```$", SECTION, re.DOTALL | re.MULTILINE)[0]
    assert scenario.splitlines()[5].startswith("  plant: ")
    assert "loop.yaml:6:3: `plant` on host `partner`: the file `parts.py` is not the" in SECTION
