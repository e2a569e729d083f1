"""The process beside a host ends as the host does, so that whoever waits for it learns how."""

import signal
import subprocess
import sys

import pytest

from orchestrator.remote.guard import guarded

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="only Linux has it")

PROGRAM = f"""
import os, signal, sys, time
from {guarded.__module__} import guarded
guarded(lifeline=0)
print("guarded", flush=True)
"""


def started(deed: str) -> "subprocess.Popen[str]":
    return subprocess.Popen(
        [sys.executable, "-c", PROGRAM + deed],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )


@pytest.mark.parametrize(
    ("deed", "code"),
    [
        ("", 0),
        ("sys.exit(3)", 3),
        ("os._exit(77)", 77),
        ("os.kill(os.getpid(), signal.SIGTERM)", -signal.SIGTERM),
        ("os.kill(os.getpid(), signal.SIGSEGV)", -signal.SIGSEGV),
        ("os.kill(os.getpid(), signal.SIGKILL)", -signal.SIGKILL),
    ],
)
def test_it_ends_as_the_host(deed: str, code: int) -> None:
    with started(deed) as process:
        assert process.stdout is not None
        assert process.stdout.read() == "guarded\n"
        assert process.wait() == code


def test_it_ends_with_the_lifeline() -> None:
    with started("time.sleep(1000)") as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "guarded\n"
        assert process.stdin is not None
        process.stdin.close()
        assert process.stdout.read() == ""  # the host, which had it open, is gone, too
        assert process.wait() == 1
