"""What a server says to a run that is not all ears: it waits for nobody, and nothing is lost."""

import threading
import time
from collections.abc import Iterator
from queue import SimpleQueue
from typing import Any

import pytest

from tests.adapters.hosting import free_port

pytest.importorskip("zenoh", reason="eclipse-zenoh is not installed")

from adapters.zenoh.lobby import ZenohVisit
from adapters.zenoh.session import Keys, close_session, is_matched, open_session

KEYS = Keys("0123456789abcdef", "far")


class HalfARun:
    """A run by hand: it is there, says commands, and listens from when it is told to."""

    def __init__(self, endpoint: str) -> None:
        self.session = open_session({"mode": "client", "connect/endpoints": [endpoint]})
        self.heard: SimpleQueue[tuple[str, bytes]] = SimpleQueue()
        token = KEYS.run_alive(self.session.zid())
        self._declared: list[object] = [self.session.liveliness().declare_token(token)]

    def listen(self) -> None:
        for key in (KEYS.output, KEYS.end):
            self._declared.append(self.session.declare_subscriber(key, self._hear))

    def _hear(self, sample: Any) -> None:
        self.heard.put((str(sample.key_expr), sample.payload.to_bytes()))


def hear(visit: ZenohVisit, run: HalfARun, count: int) -> list[tuple[str, bytes]]:
    """The first things that the run hears while the visit waits for a command, which never comes.

    Args:
        count: how many it waits for, up to 10 s.
    """
    deadline = time.monotonic() + 10
    while run.heard.qsize() < count and time.monotonic() < deadline:
        with pytest.raises(TimeoutError):
            visit.receive(0.05)
    return [run.heard.get_nowait() for _ in range(run.heard.qsize())]


@pytest.fixture
def endpoint() -> str:
    return f"tcp/127.0.0.1:{free_port()}"


@pytest.fixture
def visit(endpoint: str) -> Iterator[ZenohVisit]:
    session = open_session({"mode": "peer", "listen/endpoints": [endpoint]})
    yield ZenohVisit(session, KEYS)
    close_session(session)


@pytest.fixture
def run(visit: ZenohVisit, endpoint: str) -> Iterator[HalfARun]:
    """It is seen by the visit, and has said a command, which was received."""
    made = HalfARun(endpoint)
    while visit.absence:
        time.sleep(0.001)
    command = made.session.declare_publisher(KEYS.command)
    while not is_matched(command):
        time.sleep(0.001)
    command.put(b"the command")
    assert visit.receive(10.0) == b"the command"
    yield made
    close_session(made.session)


def test_a_reply_waits_for_a_run_that_does_not_listen_and_nobody_waits_for_it(
    visit: ZenohVisit, run: HalfARun
) -> None:
    """A run that is there and never listens would keep a server from its end."""
    sending = threading.Thread(target=lambda: visit.send(b"the reply"), daemon=True)
    sending.start()
    sending.join(10)
    assert not sending.is_alive()
    with pytest.raises(TimeoutError):
        visit.receive(0.05)
    run.listen()
    assert hear(visit, run, 1) == [(KEYS.output, b"the reply")]


def test_a_loss_that_was_not_heard_is_said_again_when_the_run_asks_again(
    visit: ZenohVisit, run: HalfARun
) -> None:
    """The same command again means that what was said since was lost with a connection."""
    run.listen()
    visit.send(b"the reply")
    visit.lose("it fell over")
    assert sorted(hear(visit, run, 2)) == [(KEYS.end, b"it fell over"), (KEYS.output, b"the reply")]
    run.session.put(KEYS.command, b"the command")
    assert hear(visit, run, 1) == [(KEYS.end, b"it fell over")]
