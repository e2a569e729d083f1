"""docs/exports.md is true: its commands and its program run, its formats are all there are."""

import re
import shlex
from pathlib import Path
from typing import Any

import pytest

from orchestrator.cli import main
from studies.exports.command import FORMATS

PAGE = Path(__file__).parents[3] / "docs" / "exports.md"

pytest.importorskip("foxglove")
pytest.importorskip("osi3")


def test_the_commands_and_the_program_of_the_page_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In their order; the run is shortened."""
    monkeypatch.chdir(tmp_path)
    (block,) = re.findall(r"```sh\n(nlosim run .*?)```", PAGE.read_text(), re.DOTALL)
    for line in block.splitlines():
        _, *words = shlex.split(line)
        short = ["--set", "time.stop=500 ms", "--set", "measures={}", "--quiet"]
        assert main([*words, *(short if words[0] == "run" else [])]) == 0
    names: dict[str, Any] = {}
    _, program = re.findall(r"```python\n(.*?)```", PAGE.read_text(), re.DOTALL)
    exec(compile(program, "page", "exec"), names)  # noqa: S102 - our own manual
    assert len(names["vehicles"]) == 11
    assert all(count > 50 for count in names["vehicles"])
    written = {path.name for path in (tmp_path / "runs" / "red_light-1" / "export").iterdir()}
    assert written == {"csv", "parquet", "fcd", "red_light-1.mcap"}


def test_every_format_is_on_the_page() -> None:
    assert set(re.findall(r"^\| `--(\w+)`", PAGE.read_text(), re.MULTILINE)) == set(FORMATS)


def test_rerun_reads_what_the_page_says(
    street: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("rerun.chunk")
    monkeypatch.chdir(tmp_path)
    assert main(["export", str(street), "--rerun", "--out", "red_light-1.rrd"]) == 0
    program, _ = re.findall(r"```python\n(.*?)```", PAGE.read_text(), re.DOTALL)
    names: dict[str, Any] = {}
    exec(compile(program, "page", "exec"), names)  # noqa: S102 - our own manual
    section = PAGE.read_text().partition("## Rerun")[2]
    told = set(re.findall(r"`/(\w+(?:/[a-z]+)?)", section.partition("Everything is")[0]))
    groups = {"/".join(entity.split("/")[1:3]) for entity in names["rows"]}
    assert (
        groups - {"__properties", "__properties/nlosim", "log", "world", "signals/messages"} <= told
    )
