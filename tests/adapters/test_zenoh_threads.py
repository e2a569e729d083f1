"""Threads of Zenoh that call us back, and ours that are in a call of Zenoh's."""

import socket
import subprocess
import sys
import threading
from collections import defaultdict
from collections.abc import Callable
from queue import SimpleQueue
from time import monotonic, sleep
from typing import cast

import pytest
import zenoh
from zenoh.handlers import Callback

from adapters.zenoh.session import close_session, is_matched, open_session
from adapters.zenoh.threads import stay_known

COUNT = 50
AT_THE_END = """
import sys, threading, time, types
from orchestrator import leaving
leaving.prepare()
from adapters.zenoh.session import open_session
session = open_session({"mode": "peer", "listen/endpoints": []})
publisher = session.declare_publisher("threads")
def put():
    while True:
        publisher.put(bytes(100))
threading.Thread(target=put, daemon=True).start()
class Slow:
    def __del__(self, clock=time.monotonic):
        end = clock() + 0.1
        while clock() < end:
            pass
sys.modules["holder"] = types.ModuleType("holder")
sys.modules["holder"].slow = Slow()
time.sleep(0.05)
sys.exit(leaving.ends_with(4))
"""
"""A program that Ctrl-C ends once more while it waits for a thread, as `nlosim serve` does."""


def test_a_thread_that_calls_back_stays_known_to_python() -> None:
    """What belongs to the thread is there again in its next callback, and others run meanwhile."""
    own = threading.local()
    came: SimpleQueue[tuple[int, int]] = SimpleQueue()

    def on_sample(sample: zenoh.Sample) -> None:
        del sample
        stay_known()
        own.count = getattr(own, "count", 0) + 1
        came.put((threading.get_ident(), own.count))

    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        endpoint = f"tcp/127.0.0.1:{probe.getsockname()[1]}"
    listening = open_session({"mode": "peer", "listen/endpoints": [endpoint]})
    speaking = open_session({"mode": "client", "connect/endpoints": [endpoint]})
    try:
        _subscriber = listening.declare_subscriber("threads", Callback(on_sample, indirect=False))
        publisher = speaking.declare_publisher("threads")
        before = monotonic()
        while not is_matched(publisher) and monotonic() < before + 30:
            sleep(0.01)
        counts = defaultdict(list)
        for _ in range(COUNT):
            publisher.put(b"x")
            thread, count = came.get(timeout=30)
            counts[thread].append(count)
    finally:
        close_session(speaking)
        close_session(listening)
    assert threading.get_ident() not in counts
    assert sum(map(len, counts.values())) == COUNT
    for found in counts.values():
        assert found == list(range(1, len(found) + 1))


def test_a_thread_in_a_call_of_zenoh_takes_no_process_along() -> None:
    """Before Python 3.14 Python ends such a thread so that Zenoh aborts: exit code -6."""
    words = [sys.executable, "-c", AT_THE_END]
    done = subprocess.run(words, capture_output=True, text=True, timeout=60, check=False)
    assert (done.returncode, done.stderr) == (4, "")


class Session:
    """What `close_session` sees of a session; closing it is `deed`."""

    def __init__(self, deed: Callable[[], object]) -> None:
        self.close = deed


def closed(deed: Callable[[], object]) -> float:
    """How long it took to close a session whose closing does `deed` [s]."""
    begin = monotonic()
    close_session(cast("zenoh.Session", Session(deed)))
    return monotonic() - begin


def test_a_session_whose_threads_have_died_holds_nobody_up(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """It is kept, too: Zenoh closes what is forgotten, and waits once more."""
    monkeypatch.setattr("adapters.zenoh.session._CLOSING", 0.1)
    left: list[object] = []
    monkeypatch.setattr("adapters.zenoh.session._left_open", left)
    never = threading.Event()
    assert 0.1 <= closed(never.wait) < 5.0
    assert "a session is left open: it was not closed within 0.1 s" in caplog.text
    assert len(left) == 1
    never.set()
    assert closed(never.wait) < 5.0
    assert len(left) == 1, "what could be closed is not kept"


def test_where_there_can_be_no_thread_a_session_is_left_open(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    def refuse(_: object) -> None:
        raise RuntimeError("can't start new thread")

    left: list[object] = []
    monkeypatch.setattr("adapters.zenoh.session._left_open", left)
    monkeypatch.setattr(threading.Thread, "start", refuse)
    done: list[int] = []
    closed(lambda: done.append(1))
    assert (len(left), done) == (1, [])
    assert "a session is left open: can't start new thread" in caplog.text


def test_a_session_that_zenoh_cannot_close_in_time_is_no_error(
    caplog: pytest.LogCaptureFixture,
) -> None:
    def fail() -> None:
        raise zenoh.ZError("close timed out")

    with caplog.at_level("DEBUG", "adapters.zenoh.session"):
        closed(fail)
    assert "a session was not closed in time: close timed out" in caplog.text
    assert "left open" not in caplog.text


LEFT_OPEN = """
import threading, types
from adapters.zenoh import session
session._CLOSING = 0.1
session.close_session(types.SimpleNamespace(close=threading.Event().wait))
"""


def test_a_session_that_is_left_open_keeps_no_process_from_its_end() -> None:
    words = [sys.executable, "-c", LEFT_OPEN]
    done = subprocess.run(words, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 0
    assert "not closed within 0.1 s" in done.stderr
