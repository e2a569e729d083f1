"""A run that is cut off in this process still says who was stepping, and when."""

import json
import os
import signal
import struct
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from orchestrator.cli import main
from orchestrator.last_call import FILE
from orchestrator.recording.reader import Recording

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="only there somebody waits")

MODULE = """\
import ctypes, os, signal, time
from dataclasses import dataclass
import numpy as np
from orchestrator.component import Component
from orchestrator.parameters import parameter
from orchestrator.scratch import discard, temporary_folder
from orchestrator.signal import Causality, Connector

DEEDS = {
    "crash": lambda: ctypes.string_at(0),
    "exit": lambda: ctypes.CDLL(None).exit(0),
    "end": lambda: os._exit(0),
    "kill": lambda: os.kill(os.getpid(), signal.SIGKILL),
    "wait": lambda: time.sleep(60),
    "nap": lambda: time.sleep(0.1),
}


def hang():
    # code that never returns, and lets Python hear no signal
    mutex, lock = ctypes.create_string_buffer(256), ctypes.CDLL(None).pthread_mutex_lock
    lock(mutex)
    with open("hanging", "w") as file:
        file.write(str(os.getpid()))
    lock(mutex)


DEEDS["hang"] = hang


class Bad(Component):
    @dataclass(frozen=True, slots=True, kw_only=True)
    class Parameters:
        deed: str = parameter(doc="what it does")
        when: str = parameter("step", doc="in which call")

    def __init__(self, parameters):
        self._given = parameters

    @property
    def connectors(self):
        return {"y": Connector(causality=Causality.OUTPUT)}

    def _do(self, when):
        if self._given.when == when:
            DEEDS[self._given.deed]()

    def setup(self, start, rng):
        self._folder = temporary_folder("bad")
        self._t = 0
        self._do("setup")

    def step(self, inputs, t, h):
        self._t = t + h
        if t == 300_000_000:
            time.sleep(0.6)  # the recorder writes out what it has
        if t >= 400_000_000:
            self._do("step")

    def outputs(self):
        return {"y": np.array(float(self._t))}

    def close(self):
        self._do("close")
        discard(self._folder)
"""
SCENARIO = """\
schema: 1
title: A bad one
time: {stop: 1 s}
components:
  good: {type: "parts:Bad", step: 100 ms, parameters: {deed: none, when: never}}
  plant: {type: "parts:Bad", step: 100 ms, parameters: {deed: crash}}
"""


@pytest.fixture
def scenario(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A scenario; afterwards no temporary file may be left."""
    temporary = tmp_path / "temporary"
    temporary.mkdir()
    monkeypatch.setenv("TMPDIR", str(temporary))
    monkeypatch.setattr(tempfile, "tempdir", str(temporary))
    (tmp_path / "parts.py").write_text(MODULE)
    path = tmp_path / "bad.yaml"
    path.write_text(SCENARIO)
    yield path
    assert list(temporary.iterdir()) == []


def command(scenario: Path, *options: str) -> list[str]:
    """A run in another process, from the folder of the scenario."""
    own = ["run", scenario.name, "--out", "run", "--quiet", *options]
    return [sys.executable, "-m", "orchestrator", *own]


def environment() -> dict[str, str]:
    """Where the run finds what this process finds."""
    return {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}


def crashed(scenario: Path, deed: str, when: str = "step") -> tuple[str, dict[str, str]]:
    """What is said of a run that does `deed`, and its manifest."""
    given = [f"components.plant.parameters.{key}" for key in (f"deed={deed}", f"when={when}")]
    options = [word for each in given for word in ("--set", each)]
    done = subprocess.run(
        command(scenario, *options),
        cwd=scenario.parent,
        env=environment(),
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 3, done.stderr
    assert done.stdout == ""
    manifest = json.loads((scenario.with_name("run") / "manifest.json").read_text())
    return done.stderr, manifest


@pytest.mark.slow
@pytest.mark.parametrize(
    ("deed", "how"),
    [
        ("crash", "was killed by SIGSEGV"),
        ("exit", "exited with code 0"),
        ("kill", "was killed by SIGKILL"),
    ],
)
def test_the_command_says_who_was_stepping_when(scenario: Path, deed: str, how: str) -> None:
    """The recording has all that was written out: five points of each, at 0 to 0.4 s."""
    said, manifest = crashed(scenario, deed)
    text = f"crash in process: `plant` was stepping at t = 0.4 s (the process {how})"
    assert said == f"error: {text}\nrecorded until then: {scenario.with_name('run')}\n"
    assert (manifest["status"], manifest["error"]) == ("crashed", text)
    assert manifest["reached_ns"] == 400_000_000  # type: ignore[comparison-overlap]
    recording = Recording(scenario.with_name("run"))
    assert recording["good.y"].values.tolist() == [k * 1e8 for k in range(5)]
    assert recording.damage == ()
    assert not (scenario.with_name("run") / FILE).exists()
    if deed == "crash":
        assert 'parts.py", line' in (scenario.with_name("run") / "log.txt").read_text()


def test_other_calls_are_named_too(scenario: Path) -> None:
    said, _ = crashed(scenario, "end", "setup")
    assert "crash in process: `plant` was being set up at t = 0 s (" in said


def until_stepping_from(t: int, scenario: Path, process: "subprocess.Popen[Any]") -> None:
    """Wait until `plant` steps from `t` [ns] or a later time."""
    file, reached = scenario.with_name("run") / FILE, -1
    while reached < t:
        assert process.poll() is None
        time.sleep(0.02)
        content = file.read_bytes() if file.exists() else b""
        call, time_ = struct.unpack_from("<qq", content) if len(content) >= 16 else (0, 0)
        reached = time_ if call == 3 << 32 | 1 else reached


def until_hanging(scenario: Path) -> None:
    """Wait until code that never returns has the process: it sleeps, as often as one looks."""
    file = scenario.with_name("hanging")
    while not (file.exists() and file.read_text()):
        time.sleep(0.02)
    stat, asleep = Path("/proc") / file.read_text() / "stat", 0
    while asleep < 10:
        time.sleep(0.02)
        asleep = asleep + 1 if stat.read_text().rpartition(") ")[2].startswith("S") else 0


@pytest.mark.slow
def test_what_is_killed_with_all_that_waits_for_it_is_known_to_the_next_command(
    scenario: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Whoever waits is killed, and so the run with it; a run that goes on is left alone."""
    wait = ("--set", "components.plant.parameters.deed=wait")
    process = subprocess.Popen(
        command(scenario, *wait), cwd=scenario.parent, env=environment(), start_new_session=True
    )
    run = scenario.with_name("run")
    until_stepping_from(400_000_000, scenario, process)
    assert Recording(run).manifest["status"] == "running"
    process.send_signal(signal.SIGKILL)
    process.wait()
    while Recording(run).manifest["status"] == "running":
        time.sleep(0.02)
    text = "the run was cut off, by a crash or from outside: `plant` was stepping at t = 0.4 s"
    assert Recording(run).manifest["error"] == text
    assert main(["report", str(run), "--measures", "all"]) in {0, 2}
    capsys.readouterr()
    short = ["--set", "components.plant.parameters.when=never", "--out", str(run) + "-2"]
    assert main(["run", str(scenario), "--quiet", *short]) == 0  # sweeps what the other one left


@pytest.mark.slow
def test_a_hang_is_named_at_the_first_request_to_stop_and_ended_at_the_second(
    scenario: Path,
) -> None:
    process = subprocess.Popen(
        command(scenario, "--set", "components.plant.parameters.deed=hang"),
        cwd=scenario.parent,
        env=environment(),
        stderr=subprocess.PIPE,
        text=True,
    )
    until_stepping_from(400_000_000, scenario, process)
    until_hanging(scenario)
    assert process.stderr is not None
    process.send_signal(signal.SIGINT)
    assert process.stderr.readline() == "\n"
    who = "`plant` was stepping at t = 0.4 s"
    waiting = f"waiting: {who} and has not come back; again to end the process\n"
    assert process.stderr.readline() == waiting
    process.send_signal(signal.SIGINT)
    with process:
        said = process.stderr.read()
    assert process.returncode == 3
    how = "it did not come back when the run was asked to stop, and was killed"
    text = f"hang in process: {who} ({how})"
    assert said == f"error: {text}\nrecorded until then: {scenario.with_name('run')}\n"
    recording = Recording(scenario.with_name("run"))
    assert (recording.manifest["status"], recording.manifest["error"]) == ("crashed", text)
    assert recording["good.y"].values.tolist() == [k * 1e8 for k in range(5)]


@pytest.mark.slow
def test_a_request_to_stop_reaches_the_run(scenario: Path) -> None:
    """Once, wherever it comes from: the run ends at a communication point, with exit code 4."""
    wait = ("--set", "components.plant.parameters.deed=nap", "--set", "time.stop=1000 s")
    process = subprocess.Popen(
        command(scenario, *wait),
        cwd=scenario.parent,
        env=environment(),
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    until_stepping_from(400_000_000, scenario, process)
    os.killpg(process.pid, signal.SIGTERM)  # both processes, as `timeout` does
    _, said = process.communicate()
    assert (process.returncode, "interrupted\n" in said) == (4, True)
    assert said.count("stopping at the next communication point") == 1
    manifest = json.loads((scenario.with_name("run") / "manifest.json").read_text())
    assert manifest["status"] == "interrupted"
