"""The orchestrator's end of a line, by itself: what it hears, and when it hears no more."""

from collections.abc import Iterator
from queue import SimpleQueue
from typing import Any

import pytest

pytest.importorskip("zenoh", reason="eclipse-zenoh is not installed")

from zenoh.handlers import Callback

from adapters.zenoh.line import Line, News
from adapters.zenoh.session import Keys, close_session, is_matched, open_session
from tests.adapters.hosting import until

KEYS = Keys("run", "a")


@pytest.fixture
def session() -> Iterator[Any]:
    """One that meets nobody, and hears what it says itself."""
    opened = open_session({"mode": "peer", "listen/endpoints": []})
    yield opened
    close_session(opened)


def test_a_line_that_was_closed_hears_nothing_and_leaves_its_keys_to_the_next(
    session: Any,
) -> None:
    """A component that moves to another host gets a new line under the same keys."""
    line = Line(session, KEYS, "a", "its process")
    replies = session.declare_publisher(KEYS.output)
    assert until(lambda: is_matched(replies))
    replies.put(b"first")
    token = session.liveliness().declare_token(KEYS.alive("host"))
    heard = {line.next(5.0) for _ in range(2)}
    assert heard == {(News.REPLY, b"first"), (News.CONNECTED, b"")}
    line.close()
    assert until(lambda: not is_matched(replies))
    following = Line(session, KEYS, "a", "its process")
    assert until(lambda: is_matched(replies))
    replies.put(b"second")
    heard = {following.next(5.0) for _ in range(2)}
    assert heard == {(News.REPLY, b"second"), (News.CONNECTED, b"")}
    token.undeclare()
    assert following.next(5.0) == (News.DISCONNECTED, b"")
    with pytest.raises(TimeoutError):
        line.next(0.0)
    following.close()


def test_a_command_is_said_again_when_somebody_hears_it(session: Any) -> None:
    """Once: the host was gone, and is there again before it listens."""
    line = Line(session, KEYS, "a", "its process")
    line.send(b"step")
    for _ in range(2):  # it comes, and leaves, and comes back, and leaves
        token = session.liveliness().declare_token(KEYS.alive("host"))
        assert line.next(5.0) == (News.CONNECTED, b"")
        token.undeclare()
        assert line.next(5.0) == (News.DISCONNECTED, b"")
    heard: SimpleQueue[bytes] = SimpleQueue()
    for _ in range(3):
        with pytest.raises(TimeoutError):
            line.next(0.01)
    listening = session.declare_subscriber(
        KEYS.command, Callback(lambda said: heard.put(said.payload.to_bytes()), indirect=False)
    )

    def has_said() -> bool:
        with pytest.raises(TimeoutError):
            line.next(0.01)
        return not heard.empty()

    assert until(has_said)
    for _ in range(3):
        has_said()
    assert (heard.get(), heard.empty()) == (b"step", True)
    listening.undeclare()
    line.close()
