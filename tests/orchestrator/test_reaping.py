"""Nothing that a component starts outlives its host, and no host its orchestrator (Linux)."""

import os
import signal
import subprocess
import sys
import textwrap
import time
from pathlib import Path

import pytest

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="only there")

MODULE = """\
import ctypes, os, subprocess, sys
import numpy as np
from orchestrator.component import Component
from orchestrator.signal import Causality, Connector


class Parent(Component):
    connectors = {"pids": Connector(causality=Causality.OUTPUT, dtype=np.int64, shape=(3,))}

    def setup(self, start, rng):
        self._child = subprocess.Popen(["sleep", "100"], start_new_session=True)

    def step(self, inputs, t, h):
        if t:
            ctypes.PyDLL(None).sleep(100)

    def outputs(self):
        return {"pids": np.array([os.getpid(), os.getppid(), self._child.pid])}
"""
SCRIPT = """\
import os, sys, time
from orchestrator.randomness import stream
from orchestrator.remote.launching import launch
from orchestrator.remote.local import LocalTransport
from orchestrator.remote.specification import ComponentSpec

specs = [ComponentSpec(name="a", type="parenting:Parent", values={})]
with launch(specs, LocalTransport()) as components:
    a = components["a"]
    a.setup(0, stream(1, "a"))
    a.initialise({})
    a.step({}, 0, 1)
    print(*a.outputs()["pids"], flush=True)
    if sys.argv[1] == "hold":
        a.begin_step({}, 1, 1)
        time.sleep(100)
    elif sys.argv[1] == "hang":
        a._deadlines = type(a._deadlines)(step=0.3)
        a.step({}, 1, 1)
"""


def is_gone(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] == "Z"
    except OSError:
        return True


def left(pids: list[int]) -> list[int]:
    """Which of these processes are there still after two seconds."""
    until = time.monotonic() + 2
    while time.monotonic() < until and not all(map(is_gone, pids)):
        time.sleep(0.01)
    return [pid for pid in pids if not is_gone(pid)]


@pytest.mark.parametrize("how", ["hold", "hang", "leave", "kill the guard", "kill the host"])
def test_nothing_is_left(tmp_path: Path, how: str) -> None:
    """The component holds the interpreter lock and has a child with a session of its own."""
    (tmp_path / "parenting.py").write_text(MODULE)
    path = os.pathsep.join([str(tmp_path), *filter(None, sys.path)])
    process = subprocess.Popen(
        [sys.executable, "-c", textwrap.dedent(SCRIPT), "hold" if " " in how else how],
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        env={**os.environ, "PYTHONPATH": path},
    )
    with process:
        assert process.stdout is not None
        host, guard, child = map(int, process.stdout.readline().split())
        victim = {"hold": process.pid, "kill the guard": guard, "kill the host": host}.get(how)
        if victim is not None:
            time.sleep(0.2)  # it is in the step that never ends
            os.kill(victim, signal.SIGKILL)
        of_them = [host, guard] if how == "kill the guard" else [host, guard, child]
        try:
            assert left(of_them) == []
        finally:
            if not is_gone(child):
                os.kill(child, signal.SIGKILL)
            process.kill()
