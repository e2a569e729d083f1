"""The process beside a host ends as the host does, so that whoever waits for it learns how."""

import os
import signal
import subprocess
import sys

import pytest

from orchestrator.remote import process
from orchestrator.remote.guard import guarded
from orchestrator.remote.local import LocalLink
from orchestrator.remote.memory import Exchange

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
    with started(deed) as running:
        assert running.stdout is not None
        assert running.stdout.read() == "guarded\n"
        assert running.wait() == code


def test_it_ends_with_the_lifeline() -> None:
    with started("time.sleep(1000)") as running:
        assert running.stdout is not None
        assert running.stdout.readline() == "guarded\n"
        assert running.stdin is not None
        running.stdin.close()
        assert running.stdout.read() == ""  # the host, which had it open, is gone, too
        assert running.wait() == 1


def test_a_host_whose_parent_says_nothing_ends() -> None:
    program = """
import sys
from orchestrator.remote import host_main
host_main.guarded = lambda lifeline: None  # which would end it
sys.exit(host_main.main())
"""
    command = [sys.executable, "-c", program]
    said = subprocess.run(command, input=b"{", capture_output=True, check=False, timeout=60)
    assert said.returncode == 1
    assert said.stderr.endswith(b"the parent ended before it said how to connect\n")


def test_one_whose_guard_hangs_is_killed_with_all_of_its_session(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    link = LocalLink("b", 0, Exchange(), "")
    monkeypatch.setattr(process, "_GUARD_TAKES", 0.0)
    monkeypatch.setattr(link._process, "_close_input", lambda: None)  # the guard hears nothing
    monkeypatch.setattr(link._process, "_signal", lambda number: None)
    link.abandon()
    with pytest.raises(ProcessLookupError):
        os.killpg(link._process.pid, 0)
    monkeypatch.undo()
    link._process.kill()
