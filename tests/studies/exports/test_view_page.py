"""`nlosim view --page`: any browser gets the run, without an extra, until Ctrl-C."""

import json
import re
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any
from urllib.request import urlopen

import pytest

from orchestrator.cli import main

SCENARIO = """\
schema: 1
title: Two numbers
time: {stop: 30 ms}
components:
  part: {type: "parts:Part", step: 10 ms}
"""
PARTS = """\
import numpy as np

from orchestrator.component import Component
from orchestrator.signal import Causality, Connector


class Part(Component):
    connectors = {"y": Connector(causality=Causality.OUTPUT)}

    def setup(self, start, rng):
        self._y = 0.0

    def step(self, inputs, t, h):
        self._y += 1.0

    def outputs(self):
        return {"y": np.array(self._y)}
"""


@pytest.fixture
def run(tmp_path: Path) -> Path:
    (tmp_path / "two.yaml").write_text(SCENARIO)
    (tmp_path / "parts.py").write_text(PARTS)
    out = tmp_path / "run"
    assert main(["run", str(tmp_path / "two.yaml"), "--quiet", "--out", str(out)]) == 0
    return out


@pytest.mark.skipif(sys.platform == "win32", reason="no such signals there")
def test_a_finished_run_is_shown_until_ctrl_c(run: Path) -> None:
    words = [sys.executable, "-m", "orchestrator", "view", "--page", str(run), "--port", "0"]
    process = subprocess.Popen(
        [*words, "--json"], stderr=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    with process:
        assert process.stderr is not None
        line = process.stderr.readline()
        found = re.match(
            r"(http://127\.0\.0\.1:\d+/) shows `.*run` in a browser; Ctrl-C ends", line
        )
        assert found, line
        state: dict[str, Any] = {"version": 0}
        while not state["version"]:
            with urlopen(f"{found[1]}state.json") as answer:  # noqa: S310 - our own address
                state = json.load(answer)
        process.send_signal(signal.SIGINT)
        try:
            output, errors = process.communicate(timeout=30)
        finally:
            process.kill()
    assert (process.returncode, errors) == (0, "")
    assert (state["status"], state["reached"]) == ("done", 0.03)
    assert json.loads(output)["pages"] == 1


def test_a_run_that_does_not_go_on_is_not_live(
    run: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["view", "--page", "--live", str(run)]) == 2
    said = f"the run in `{run}` does not go on; leave --live out"
    assert said in capsys.readouterr().err


def test_there_must_be_a_run(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["view", "--page", str(tmp_path / "none")]) == 2
    assert f"there is no directory `{tmp_path / 'none'}`" in capsys.readouterr().err
