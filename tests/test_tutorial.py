"""The tutorial is true: its files, commands and programs run in order and print what it shows."""

import io
import os
import re
import shlex
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import redirect_stdout
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import pytest

ROOT = Path(__file__).parents[1]
PAGE = ROOT / "docs" / "tutorial.md"


@dataclass(frozen=True, slots=True, kw_only=True)
class Block:
    """A fenced block: its language, the file that it is, if it has a name, and its text."""

    language: str
    file: str
    text: str


def blocks() -> Iterator[Block]:
    for language, file, text in re.findall(
        r"^```(\w+) ?(\S*)\n(.*?)^```$", PAGE.read_text(), re.DOTALL | re.MULTILINE
    ):
        yield Block(language=language, file=file, text=text)


def shown(expected: str, printed: str) -> bool:
    """Whether `printed` is `expected`, in which `...` stands for anything, a whole line for many.

    Empty lines and the width of columns do not count.
    """
    pattern = "".join(
        r"(?:.*\n)*?" if line == "..." else re.escape(line).replace(r"\.\.\.", ".*") + "\n"
        for line in _lines(expected)
    )
    return re.fullmatch(pattern, "".join(f"{line}\n" for line in _lines(printed))) is not None


def _lines(text: str) -> list[str]:
    return [" ".join(line.split()) for line in text.splitlines() if line.strip()]


class Session:
    """Somebody who does in the folder `folder` what the tutorial says."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._names: dict[str, Any] = {"__name__": "tutorial"}
        self._printed = ""

    def follow(self, block: Block) -> None:
        if block.file:
            path = self._folder / block.file
            path.parent.mkdir(exist_ok=True)
            path.write_text(block.text)
        elif block.language in self._ACTIONS:
            self._ACTIONS[block.language](self, block.text)

    def _console(self, text: str) -> None:
        """Each command, and the lines below it that it prints."""
        for command, expected in re.findall(r"^\$ (.*)\n((?:[^$].*\n|\n)*)", text, re.MULTILINE):
            words = shlex.split(command)
            if words[0] == "nlosim" and "scenarios/" not in command:
                self._nlosim(words[1:])
                assert not expected or shown(expected, self._printed), self._printed

    def _nlosim(self, words: list[str]) -> None:
        path = os.pathsep.join([str(self._folder), os.environ.get("PYTHONPATH", "")])
        done = subprocess.run(
            [sys.executable, "-m", "orchestrator", *words],
            cwd=self._folder,
            env={**os.environ, "PYTHONPATH": path},
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 0, done.stderr
        self._printed = done.stdout

    def _python(self, text: str) -> None:
        printed = io.StringIO()
        with redirect_stdout(printed):
            exec(compile(text, PAGE.name, "exec"), self._names)  # noqa: S102 - our own manual
        self._printed = printed.getvalue()

    def _text(self, expected: str) -> None:
        assert shown(expected, self._printed), self._printed

    _ACTIONS: ClassVar[dict[str, Callable[["Session", str], None]]] = {
        "console": _console,
        "python": _python,
        "text": _text,
    }


@pytest.mark.slow
def test_whoever_follows_it_gets_what_it_shows(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    shutil.copytree(ROOT / "docs" / "examples", tmp_path / "docs" / "examples")
    session = Session(tmp_path)
    for block in blocks():
        session.follow(block)
    assert (tmp_path / "stop.png").stat().st_size > 0


def test_dots_stand_for_any_lines_and_nothing_else_may_differ() -> None:
    printed = "one\ntwo   2\n8 s simulated in 0.06 s (135 simulated seconds per second)\nthree\n"
    assert shown("one\n...\nthree\n", printed)
    assert shown("one\ntwo 2\n8 s simulated in ...\nthree\n", printed)
    assert not shown("one\ntwo 3\n...\n", printed)
    assert not shown("one\ntwo 2\n", printed)
