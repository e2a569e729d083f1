"""What components print: kept as far as there is room, and never what a run waits for."""

import logging
import subprocess
import sys
import time
from pathlib import Path

import pytest

from orchestrator.errors import ComponentError
from orchestrator.limits import Deadlines
from orchestrator.remote.launching import launch
from orchestrator.remote.local import LocalTransport
from orchestrator.remote.output import Output
from orchestrator.remote.specification import ComponentSpec


def printed(program: str, kept: int, caplog: pytest.LogCaptureFixture) -> tuple[list[str], Output]:
    """What is logged of what a program prints."""
    with caplog.at_level(logging.INFO):
        process = subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE)
        assert process.stdout is not None
        output = Output("a", process.stdout, kept)
        process.wait()
        output.wait(30)
    return [record.getMessage() for record in caplog.records], output


def test_what_fits_is_logged_line_by_line(caplog: pytest.LogCaptureFixture) -> None:
    """Also the last one, which has no end."""
    said, output = printed("print('one\\n\\nthree', end='')", 1000, caplog)
    assert said == ["`a`: one", "`a`: three"]
    assert output.last_lines == ["one", "three"]


def test_of_the_rest_its_size_and_its_end_are_logged(caplog: pytest.LogCaptureFixture) -> None:
    """Of 1000 lines of 200 bytes the first 50, and the last 20."""
    program = "for k in range(1000): print(f'{k:0199}')"
    said, output = printed(program, 10_000, caplog)
    assert said[:50] == [f"`a`: {k:0199}" for k in range(50)]
    last = [f"{k:0199}" for k in range(980, 1000)]
    left_out = "`a`: 190 kB of output are left out here; the last lines were:"
    assert said[50:] == ["\n    ".join([left_out, *last])]
    assert output.last_lines == last


def test_of_short_lines_there_are_fewer(caplog: pytest.LogCaptureFixture) -> None:
    """What the log adds to each counts: of 5000 lines of 2 bytes 100 are kept in 10 kB."""
    said, _ = printed("print('x\\n' * 5000, end='')", 10_000, caplog)
    assert said[:100] == ["`a`: x"] * 100
    assert said[100].startswith("`a`: 9.8 kB of output are left out here;")
    assert len(said) == 101


def test_a_line_without_end_takes_no_memory(caplog: pytest.LogCaptureFixture) -> None:
    """Of 30 MB in one line 25 kB are kept, in entries of 10 kB at most."""
    program = "import sys\nfor _ in range(300): sys.stdout.write('x' * 100_000)"
    said, output = printed(program, 25_000, caplog)
    assert sum(line.count("x") for line in said[:-1]) == 25_000
    assert max(len(line) for line in said) < 10_100
    assert "30 MB of output are left out" in said[-1]
    assert output.last_lines == ["x" * 500]


def test_a_flood_slows_no_run(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """The component prints 20 MB in lines of 100 bytes, and dies: its end is quoted."""
    (tmp_path / "flooding.py").write_text(FLOODING)
    monkeypatch.syspath_prepend(tmp_path)
    specs = [ComponentSpec(name="a", type="flooding:Flooding", values={})]
    with (
        caplog.at_level(logging.INFO),
        launch(specs, LocalTransport(), deadlines=Deadlines(step=20)) as components,
    ):
        before = time.process_time()
        with pytest.raises(
            ComponentError, match=r"exited with code 3; it wrote last:(\n    x+){20}$"
        ):
            components["a"].step({}, 0, 1)
        spent = time.process_time() - before
    assert sum(len(record.getMessage()) for record in caplog.records) < 1_400_000
    assert spent < 4, "20 MB in lines took 3.5 s when each was logged"


FLOODING = """\
import os, sys
from orchestrator.component import Component


class Flooding(Component):
    connectors = {}

    def setup(self, start, rng):
        pass

    def step(self, inputs, t, h):
        for _ in range(200_000):
            sys.stdout.write("x" * 99 + "\\n")
        sys.stdout.flush()
        os._exit(3)

    def outputs(self):
        return {}
"""
