"""Messages in arrays are sent and arrive as the same messages one by one."""

import numpy as np
from hypothesis import given, strategies as st

from fmus.facilities.outbox import Broadcasts, Message, Outbox
from fmus.messages.records import BSM, PACKET, RECEPTION, unframe
from tests.fmus.facilities.world import EGO, delivered

SECOND = 1_000_000_000
message = st.tuples(st.integers(0, 9), st.integers(0, 99), st.integers(0, 500))


@given(st.lists(message, max_size=9), st.integers(1, 300))
def test_broadcasts_are_messages(sent: list[tuple[int, int, int]], fragment: int) -> None:
    messages = [
        Message(kind=BSM, time=time, source=source, size=size, content=k)
        for k, (time, source, size) in enumerate(sent)
    ]
    time, source, size = np.array(sent, np.int64).reshape(-1, 3).T
    broadcasts = Broadcasts(kind=BSM, time=time, source=source, size=size, content=lambda k: k)
    one_by_one, at_once = Outbox(fragment, SECOND), Outbox(fragment, SECOND)
    packets = one_by_one.send(messages)
    assert at_once.send([], [broadcasts]) == packets
    received = unframe("RCPT", delivered(unframe("PKTS", packets, PACKET), EGO), RECEPTION)
    assert at_once.arrivals(received) == one_by_one.arrivals(received)
    assert len(at_once.arrivals(received[:0])) == 0


def test_what_is_too_old_cannot_arrive() -> None:
    outbox = Outbox(100, 10)
    old, young = (Message(kind=BSM, time=t, source=1, size=150, content=t) for t in (0, 5))
    rows = unframe("PKTS", outbox.send([old, young]), PACKET)
    outbox.forget(12)
    received = unframe("RCPT", delivered(rows, EGO), RECEPTION)
    assert [arrival.message.content for arrival in outbox.arrivals(received)] == [5]
