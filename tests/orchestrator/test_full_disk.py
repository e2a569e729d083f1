"""A full disk ends a run in good order: the message names the file, the manifest says `failed`."""

import json
import sys
from pathlib import Path

import pytest

from orchestrator.cli import main
from orchestrator.last_call import FILE
from orchestrator.recording.reader import Recording
from tests.full_disk import files_up_to

pytestmark = pytest.mark.skipif(
    sys.platform != "linux", reason="files of limited size stand for it"
)

MODULE = """\
import time
import numpy as np
from orchestrator.component import Component
from orchestrator.signal import Causality, Connector


class Noise(Component):
    connectors = {"y": Connector(causality=Causality.OUTPUT, shape=(10000,))}

    def setup(self, start, rng):
        self._rng = rng

    def initialise(self, inputs):
        self._y = self._rng.normal(size=10000)

    def step(self, inputs, t, h):
        time.sleep(0.06)  # the recorder writes out what it has
        self._y = self._rng.normal(size=10000)

    def outputs(self):
        return {"y": self._y}
"""
SCENARIO = """\
schema: 1
title: Noise
time: {stop: 2 s}
components:
  noise: {type: "noise_parts:Noise", step: 100 ms}
"""


@pytest.mark.parametrize(
    ("size", "file", "status"),
    [
        (1_000_000, "signals/noise/y+0.npy", "failed"),  # 1.6 MB are published
        (60_000, "signals/noise/y+0.npy", "failed"),  # 80 kB at once
        (None, "manifest.json", "failed"),  # it is longer at the end than at the start
        (300, FILE, None),
    ],
)
def test_the_file_is_named_and_the_run_has_failed(
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    size: int | None,
    file: str,
    status: str | None,
) -> None:
    (tmp_path / "noise_parts.py").write_text(MODULE)
    (tmp_path / "noise.yaml").write_text(SCENARIO)
    run = tmp_path / "run"
    arguments = ["run", str(tmp_path / "noise.yaml"), "--out", str(run), "--quiet", "--no-figure"]
    if size is None:
        with files_up_to(60_000):
            main([*arguments[:3], str(tmp_path / "was"), *arguments[4:]])
        size = (tmp_path / "was" / "manifest.json").stat().st_size - 500
        capsys.readouterr()
    with files_up_to(size):
        code = main(arguments)
    said = capsys.readouterr()
    assert (code, said.out) == (2, "")
    recorded = "" if status is None else f"recorded until then: {run}\n"
    assert f"error: `{run / file}`: File too large\n{recorded}" in said.err
    assert "Traceback" not in said.err
    assert not (run / FILE).exists()
    assert not list(run.glob("**/*.draft"))
    if status is None:
        assert not (run / "manifest.json").exists()
        return
    manifest = json.loads((run / "manifest.json").read_text())
    assert (manifest["status"], file in manifest["error"]) == (status, True)
    if size == 1_000_000:
        assert 0 < len(Recording(run)["noise.y"]) * 80_000 < 1_000_000
