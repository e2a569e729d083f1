"""`nlosim run --checkpoint` and `nlosim resume`: whatever cut a run off, it comes to its end."""

import errno
import json
import os
import re
import subprocess
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import pytest

from orchestrator.cli import main
from orchestrator.last_call import FILE, noting
from orchestrator.resuming.files import FOLDER, checkpoints_of
from tests.orchestrator.resumable import contents

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="nobody is killed like this there")

MODULE = """\
import json, os, signal
from dataclasses import dataclass
from pathlib import Path
import numpy as np
from orchestrator.capabilities import PortableState
from orchestrator.component import Component
from orchestrator.parameters import parameter
from orchestrator.signal import Causality, Connector

HERE = Path(__file__).parent


class Diary(Component):
    # cannot save its state; in its step 70 it does what the file `deed` says, once
    connectors = {"u": Connector(causality=Causality.INPUT),
                  "y": Connector(causality=Causality.OUTPUT)}

    @dataclass(frozen=True, slots=True, kw_only=True)
    class Parameters:
        table: Path | None = parameter(None, doc="a file that it reads")
        gain: float = parameter(1.0, doc="of u")

    def __init__(self, parameters):
        self._gain = parameters.gain

    def setup(self, start, rng):
        self._rng, self._y, self._count = rng, 0.0, 0

    def step(self, inputs, t, h):
        self._count += 1
        mark = HERE / "deed"
        if self._count == 70 and mark.exists():
            deed = mark.read_text()
            mark.unlink()
            if deed == "raise":
                raise ValueError("the moon is too bright")
            if deed == "interrupt":
                signal.raise_signal(signal.SIGINT)
            if deed == "kill":
                os.kill(os.getpid(), signal.SIGKILL)
        self._y = 0.9 * self._y + self._gain * float(inputs["u"]) / 9 + self._rng.random()

    def outputs(self):
        return {"y": np.array(self._y)}


class Keeping(Diary, PortableState):
    def dump(self):
        return json.dumps([self._rng.bit_generator.state, self._y, self._count]).encode()

    def load(self, content):
        self._rng.bit_generator.state, self._y, self._count = json.loads(content)
"""
SCENARIO = """\
schema: 1
title: Two
time: {stop: 1 s}
components:
  one:
    type: two_parts:Keeping
    step: 10 ms
    process: on-request
    parameters: {table: table.csv}
  other: {type: "two_parts:Diary", step: 20 ms}
connections:
  - {from: one.y, to: other.u}
  - {from: other.y, to: one.u}
"""

Command = Callable[..., dict[str, Any]]


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Where the scenario is."""
    (tmp_path / "two_parts.py").write_text(MODULE)
    (tmp_path / "two.yaml").write_text(SCENARIO)
    (tmp_path / "table.csv").write_text("a\n1\n")
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def nlosim(capsys: pytest.CaptureFixture[str]) -> Command:
    """Runs a command in this process; gives what it says as JSON, its exit code as `code`."""

    def command(*words: str) -> dict[str, Any]:
        capsys.readouterr()
        code = main([*words, "--json"])
        found: dict[str, Any] = json.loads(capsys.readouterr().out)
        return {**found, "code": code}

    return command


def without_wall_time(folder: Path) -> Mapping[str, Any]:
    manifest: dict[str, Any] = json.loads((folder / "manifest.json").read_text())
    assert manifest.pop("wall_time_s").keys() == {
        "total",
        "orchestrator",
        "observers",
        "components",
    }
    manifest.pop("created")
    return manifest


def assert_same(found: Path, whole: Path) -> None:
    """Recording, manifest and metrics of two runs are the same."""
    assert contents(found) == contents(whole)
    assert without_wall_time(found) == without_wall_time(whole)
    metrics = [(each / "metrics.json").read_bytes() for each in (found, whole)]
    assert metrics[0] == metrics[1]
    names = [sorted(p.name for p in each.iterdir()) for each in (found, whole)]
    assert names[0] == names[1]


RUN = ("run", "two.yaml", "--quiet", "--no-figure")
KEPT = (*RUN, "--checkpoint", "100ms")
ENDS = {
    "raise": (3, "failed"),
    "interrupt": (4, "interrupted"),
    "kill": (3, "failed"),
}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("transport", "deed"),
    [
        ("in-process", "raise"),
        ("in-process", "interrupt"),
        ("loopback", "raise"),
        ("local", "kill"),
        ("zenoh", "kill"),
    ],
)
def test_the_run_is_that_which_nobody_cut_off(
    folder: Path, nlosim: Command, transport: str, deed: str
) -> None:
    if transport == "zenoh":
        pytest.importorskip("zenoh", reason="eclipse-zenoh is not installed")
    reached = ("--transport", transport)
    whole = nlosim(*RUN, *reached, "--out", "whole")
    (folder / "deed").write_text(deed)
    assert nlosim(*KEPT, *reached, "--out", "cut")["error"]["exit_code"] == ENDS[deed][0]
    said = json.loads((folder / "cut" / "manifest.json").read_text())
    assert said["status"] == ENDS[deed][1]
    assert "fingerprint" in said or said["status"] == "failed"
    found = nlosim("resume", "cut", "--quiet")
    assert found["code"] == 0, found
    assert found["resumed_at_s"] == 0.6
    assert found["resumed"] == [
        "the run goes on at t = 0.6 s: `one` restored; 30 steps of `other` made again"
    ]
    assert found["fingerprint"] == whole["fingerprint"]
    assert_same(folder / "cut", folder / "whole")
    again = nlosim("resume", "cut")
    assert (again["code"], again["resumed_at_s"]) == (0, None)
    assert again["fingerprint"] == whole["fingerprint"]


@pytest.mark.parametrize("quiet", [(), ("--quiet",)])
def test_where_it_goes_on_is_said_once(
    folder: Path, nlosim: Command, capsys: pytest.CaptureFixture[str], quiet: tuple[str, ...]
) -> None:
    (folder / "deed").write_text("raise")
    nlosim(*KEPT, "--out", "cut")
    assert main(["resume", "cut", "--no-figure", *quiet]) == 0
    said = capsys.readouterr()
    assert (said.err + said.out).count("the run goes on at t = 0.6 s: `one` restored") == 1
    assert "fingerprint" in said.out


@pytest.mark.parametrize("checkpoint", [("--checkpoint", "100ms"), ()], ids=["kept", "none"])
def test_after_a_kill(folder: Path, nlosim: Command, checkpoint: tuple[str, ...]) -> None:
    whole = nlosim(*RUN, "--out", "whole")
    (folder / "deed").write_text("kill")
    path = os.pathsep.join(filter(None, [str(Path(__file__).parents[2]), *sys.path]))
    words = [sys.executable, "-m", "orchestrator", *RUN, *checkpoint, "--out", "cut"]
    ended = subprocess.run(
        words, cwd=folder, env={**os.environ, "PYTHONPATH": path}, capture_output=True, check=False
    )
    assert ended.returncode in {3, -9}
    found = nlosim("resume", "cut", "--quiet", "--no-figure")
    assert found["fingerprint"] == whole["fingerprint"]
    assert found["resumed_at_s"] == (0.6 if checkpoint else 0.0)
    if not checkpoint:
        what = "the run is made again from its start, for there is no checkpoint"
        assert found["resumed"] == [what]
    assert_same(folder / "cut", folder / "whole")


@pytest.mark.parametrize(("first", "second"), [("loopback", "in-process"), ("local", "loopback")])
def test_the_transport_may_be_another_one(
    folder: Path, nlosim: Command, first: str, second: str
) -> None:
    whole = nlosim(*RUN, "--transport", second, "--out", "whole")
    (folder / "deed").write_text("raise")
    nlosim(*KEPT, "--transport", first, "--out", "cut")
    found = nlosim("resume", "cut", "--quiet", "--transport", second)
    assert (found["resumed_at_s"], found["fingerprint"]) == (0.6, whole["fingerprint"])
    assert_same(folder / "cut", folder / "whole")


def test_from_the_start_on_request(folder: Path, nlosim: Command) -> None:
    whole = nlosim(*RUN, "--out", "whole")
    (folder / "deed").write_text("raise")
    nlosim(*KEPT, "--out", "cut")
    found = nlosim("resume", "cut", "--quiet", "--from-start")
    assert (found["resumed_at_s"], found["fingerprint"]) == (0.0, whole["fingerprint"])
    assert_same(folder / "cut", folder / "whole")


def test_after_a_full_disk(folder: Path, nlosim: Command, monkeypatch: pytest.MonkeyPatch) -> None:
    """The fifth checkpoint does not fit."""
    whole = nlosim(*RUN, "--out", "whole")
    synchronise, rest = os.fsync, iter(range(13))

    def full(number: int) -> None:
        if next(rest, None) is None:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        synchronise(number)

    with monkeypatch.context() as patch:
        patch.setattr(os, "fsync", full)
        failed = nlosim(*KEPT, "--out", "cut")
    assert failed["error"]["exit_code"] == 2
    assert re.search(r"checkpoints/500000000.state`: No space left", failed["error"]["message"])
    assert [each.stem for each in checkpoints_of(folder / "cut")] == ["400000000", "300000000"]
    found = nlosim("resume", "cut", "--quiet")
    assert found["code"] == 0, found
    assert found["resumed_at_s"] == 0.4
    assert found["fingerprint"] == whole["fingerprint"]
    assert_same(folder / "cut", folder / "whole")


def change(path: Path, old: str, new: str) -> None:
    path.write_text(path.read_text().replace(old, new))


def test_what_changed_is_named(
    folder: Path, nlosim: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    (folder / "deed").write_text("raise")
    nlosim(*KEPT, "--out", "cut")
    before = contents(folder / "cut")

    def refused() -> str:
        found = nlosim("resume", "cut", "--quiet")
        assert found["code"] == 2
        assert contents(folder / "cut") == before
        return str(found["error"]["message"])

    change(folder / "table.csv", "1", "2")
    assert "`table.csv`, which `one` reads, has another content" in refused()
    change(folder / "table.csv", "2", "1")
    change(folder / "two.yaml", "table: table.csv", "table: table.csv, gain: 2.0")
    assert "`components.one.parameters.gain` is 2.0, and was 1.0" in refused()
    change(folder / "two.yaml", ", gain: 2.0", "")
    change(folder / "two_parts.py", "/ 9", "/ 8")
    assert "`two_parts.py`, which `one` reads, has another content" in refused()
    change(folder / "two_parts.py", "/ 8", "/ 9")
    known = json.loads((folder / "cut" / "manifest.json").read_text())
    monkeypatch.setitem(known["versions"], "numpy", "0.1")
    (folder / "cut" / "manifest.json").write_text(json.dumps(known))
    assert "numpy is" in (said := refused())
    assert "and was 0.1" in said


def test_of_what_is_no_run(folder: Path, nlosim: Command) -> None:
    assert "holds no run" in nlosim("resume", str(folder))["error"]["message"]
    nlosim(*RUN, "--out", "whole")
    with noting(folder / "whole", ["one"]):
        said = nlosim("resume", "whole")["error"]["message"]
    assert "has not ended: a process works on it" in said
    assert not (folder / "whole" / FILE).exists()


@pytest.mark.parametrize("text", ["0s", "soon", "-1 s"])
def test_times_that_are_none(folder: Path, text: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["run", "two.yaml", f"--checkpoint={text}"]) == 2
    assert "--checkpoint" in capsys.readouterr().err


def test_a_scenario_that_is_gone(folder: Path, nlosim: Command) -> None:
    (folder / "deed").write_text("raise")
    nlosim(*KEPT, "--out", "cut")
    (folder / "two.yaml").unlink()
    found = nlosim("resume", "cut")
    assert found["code"] == 2
    assert "two.yaml" in json.dumps(found)


def test_nothing_is_left_of_checkpoints(folder: Path, nlosim: Command) -> None:
    nlosim(*KEPT, "--out", "kept")
    nlosim(*RUN, "--out", "whole")
    assert_same(folder / "kept", folder / "whole")
    assert not (folder / "kept" / FOLDER).exists()
