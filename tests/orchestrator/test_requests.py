"""Whenever a command is asked to stop, it says one word and ends with exit code 4."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")

PROGRAM = """\
import sys
sys.argv = ["nlosim", *{arguments}]
from orchestrator.cli import main
print("begun", file=sys.stderr, flush=True)
sys.exit(main())
"""
SCENARIO = """\
schema: 1
title: A long one
time: {stop: 1000 s}
components:
  one: {type: "waiting:Waiting", step: 1 s}
"""
MODULE = """\
import time
import numpy as np
from orchestrator.component import Component
from orchestrator.signal import Causality, Connector


class Waiting(Component):
    connectors = {"y": Connector(causality=Causality.OUTPUT)}

    def setup(self, start, rng):
        pass

    def step(self, inputs, t, h):
        time.sleep(0.02)

    def outputs(self):
        return {"y": np.array(0.0)}
"""


def stopped(
    folder: Path, number: signal.Signals, after: float | None, *options: str
) -> tuple[int, str]:
    """Exit code and words of a run that got a signal some time after Python had started [s].

    Without a time, it gets the signal when it has begun to simulate.
    """
    (folder / "waiting.py").write_text(MODULE)
    (folder / "long.yaml").write_text(SCENARIO)
    arguments = ["run", str(folder / "long.yaml"), "--out", str(folder / "run"), *options]
    process = subprocess.Popen(
        [sys.executable, "-c", PROGRAM.format(arguments=arguments)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
        start_new_session=True,
    )
    with process:
        assert process.stderr is not None
        assert process.stderr.readline() == "begun\n"
        while after is None and not (folder / "run" / "manifest.json").exists():
            assert process.poll() is None
            time.sleep(0.02)
        time.sleep(after or 0.1)
        os.killpg(process.pid, number)
        said, errors = process.communicate(timeout=30)
    return process.returncode, errors + said


@pytest.mark.parametrize("after", [0.02, 0.08, 0.2, 0.4])
def test_ctrl_c_in_the_first_second(tmp_path: Path, after: float) -> None:
    """While modules are imported, while the process copies itself, while the scenario is read."""
    code, said = stopped(tmp_path, signal.SIGINT, after, "--quiet")
    assert (code, "Traceback" in said) == (4, False)
    assert said.startswith("interrupted\n") or "stopping at the next" in said, said


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP])
def test_a_terminal_that_closes_ends_a_run_as_ctrl_c_does(
    tmp_path: Path, number: signal.Signals
) -> None:
    code, said = stopped(tmp_path, number, None, "--quiet", "--json")
    assert code == 4
    found = json.loads(said[said.index("{") :])
    assert found["error"]["kind"] == "interrupted"
    assert json.loads((tmp_path / "run" / "manifest.json").read_text())["status"] == "interrupted"


@pytest.mark.skipif(sys.platform == "win32", reason="there are no such signals")
def test_a_request_within_code_compiled_from_text_does_not_end_the_process_later() -> None:
    """CPython remembers it until the process ends, and then kills itself."""
    caught = "try:\n    exec('raise KeyboardInterrupt')\nexcept KeyboardInterrupt:\n    pass\n"
    over = "from orchestrator.cli.requests import heard_no_more\nheard_no_more()\n"
    codes = [
        subprocess.run([sys.executable, "-c", text], check=False).returncode
        for text in (caught, caught + over)
    ]
    assert codes == [-signal.SIGINT, 0]
