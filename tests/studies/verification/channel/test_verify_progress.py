"""The progress bar."""

import io
import sys

import pytest
from typing_extensions import override

from studies.verification.channel.progress import Bar, NoBar, progress


class Terminal(io.StringIO):
    @override
    def isatty(self) -> bool:
        return True


def test_the_bar_names_the_file_and_is_gone_in_the_end() -> None:
    stream = Terminal()
    with Bar(2, stream) as bar:
        bar.begin("pathloss.csv")
        bar.advance()
        bar.advance()
    assert "pathloss.csv" in stream.getvalue()
    assert stream.getvalue().rstrip(" ").endswith("\r")


def test_there_is_a_bar_on_a_terminal_only(monkeypatch: pytest.MonkeyPatch) -> None:
    for stream, kind in ((io.StringIO(), NoBar), (Terminal(), Bar)):
        monkeypatch.setattr(sys, "stderr", stream)
        with progress(1) as found:
            assert isinstance(found, kind)
            found.begin("x")
            found.advance()
