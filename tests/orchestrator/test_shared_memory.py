"""Values in shared memory: where they are, who has them, and when their place is free again."""

import fcntl
import mmap
import os
import sys

import numpy as np
import pytest

from orchestrator.remote.block import WireError
from orchestrator.remote.memory import Exchange, HostMemory, LinkMemory
from orchestrator.remote.segment import OFFSET_BITS, Arena, PlaceError, Segment, can_share
from orchestrator.remote.sharing import NOTHING_SHARED
from orchestrator.remote.wire import SignalDecoder, SignalEncoder
from orchestrator.signal import Array, Causality, Connector, Signal

pytestmark = pytest.mark.skipif(not can_share(), reason="this system has no memory of this kind")

FLOAT = np.dtype(np.float64)
LENGTH = 2048


class Line:
    """The two ends of one link, whose messages carry places and segments only."""

    def __init__(self, exchange: Exchange, number: int) -> None:
        self.here = LinkMemory(exchange, number)
        self.there = HostMemory(number)

    def to_host(self) -> None:
        places, segments = self.here.leave()
        self.there.arrive(places, [(s.number, s.size, os.dup(s.descriptor)) for s in segments])

    def to_orchestrator(self) -> None:
        places, segments = self.there.leave()
        self.here.arrive(places, [(s.number, s.size, os.dup(s.descriptor)) for s in segments])

    def made(self, value: Array) -> tuple[int, Array]:
        """What the host made of `value`, as the orchestrator has it."""
        place = self.there.place(value)
        self.to_orchestrator()
        return place, self.here.array(place, value.shape, value.dtype)


def test_what_one_host_made_is_seen_by_another_at_the_same_place() -> None:
    exchange = Exchange()
    first, second = Line(exchange, 1), Line(exchange, 2)
    place, array = first.made(np.arange(LENGTH, dtype=FLOAT))
    assert second.here.place(array) == place  # nothing was copied
    second.to_host()
    seen = second.there.array(place, (LENGTH,), FLOAT)
    assert seen.tobytes() == np.arange(LENGTH, dtype=FLOAT).tobytes()
    assert not seen.flags.writeable
    assert not array.flags.writeable


def test_a_place_is_free_again_when_the_last_has_let_go_of_it() -> None:
    exchange = Exchange()
    first, second = Line(exchange, 1), Line(exchange, 2)
    value = np.arange(LENGTH, dtype=FLOAT)
    place, array = first.made(value)
    second.here.place(array)
    second.to_host()
    seen = second.there.array(place, (LENGTH,), FLOAT)
    part = seen[7:9]
    del array, seen
    second.to_orchestrator()
    first.to_host()
    assert first.there.place(value) != place  # `part` is a view of it
    assert part.tolist() == [7.0, 8.0]
    del part
    first.to_host()
    assert first.there.place(value) != place  # the second host has not told yet
    second.to_orchestrator()
    first.to_host()
    assert first.there.place(value) == place


def test_a_value_of_the_orchestrator_is_written_once_for_all_hosts() -> None:
    exchange = Exchange()
    lines = [Line(exchange, number) for number in (1, 2, 3)]
    value = np.arange(LENGTH, dtype=FLOAT)
    places = {line.here.place(value) for line in lines}
    assert len(places) == 1
    (place,) = places
    del value
    other = np.zeros(LENGTH)
    for line in lines:
        assert lines[0].here.place(other) != place
        line.to_host()
        line.there.array(place, (LENGTH,), FLOAT)  # and let go of it
        line.to_orchestrator()
    assert lines[0].here.place(np.ones(LENGTH)) == place


def test_many_steps_need_few_places() -> None:
    """In Jacobi's order a value lives for three messages; memory does not grow with the steps."""
    exchange = Exchange()
    line, other = Line(exchange, 1), Line(exchange, 2)
    places, seen = set(), []
    for step in range(100):
        place, array = line.made(np.full(LENGTH, float(step)))
        places.add(place)
        other.here.place(array)
        other.to_host()
        seen = [other.there.array(place, (LENGTH,), FLOAT)]
        assert seen[0][0] == step
        other.to_orchestrator()
        line.to_host()
    assert len(places) <= 4


def test_bytes_are_copies_and_their_place_is_free_when_the_next_come() -> None:
    exchange = Exchange()
    line = Line(exchange, 1)
    text = bytes(range(256)) * 64
    place = line.there.place(text)
    line.to_orchestrator()
    assert line.here.read(place, len(text), 0) == text
    line.to_host()
    other = line.there.place(text)
    assert other != place
    assert line.here.read(other, len(text), 1) == text  # of another signal
    line.to_host()
    assert line.there.place(text) not in (place, other)
    assert line.here.read(other, len(text), 0) == text
    line.to_host()
    assert line.there.place(text) == place


def test_bytes_that_the_orchestrator_makes_are_free_when_the_host_has_read_them() -> None:
    line = Line(Exchange(), 1)
    text = bytes(range(256)) * 64
    back = line.here.place(text)
    line.to_host()
    assert line.there.read(back, len(text), 0) == text
    line.to_orchestrator()
    assert line.here.place(text) == back


def test_bytes_that_one_host_made_are_read_by_another_at_the_same_place() -> None:
    exchange = Exchange()
    first, second, third = (Line(exchange, number) for number in (1, 2, 3))
    places = set()
    for step in range(20):
        text = bytes([step]) * 8192
        place = first.there.place(text)
        places.add(place)
        first.to_orchestrator()
        value = first.here.read(place, len(text), 0)
        for line in (second, third):
            assert line.here.place(value) == place  # nothing was copied
            line.to_host()
            assert line.there.read(place, len(text), 0) == text
            line.to_orchestrator()
        copy = value[:4096] + value[4096:]
        assert second.here.place(copy) != place  # equal, but not the same
        first.to_host()
    assert len(places) <= 3


def test_bytes_are_handed_on_until_the_next_of_their_signal_come() -> None:
    """What is late is copied; whoever has not read it yet keeps its place."""
    exchange = Exchange()
    first, second = Line(exchange, 1), Line(exchange, 2)
    old, new = bytes(8192), b"x" * 8192
    place = first.there.place(old)
    first.to_orchestrator()
    value = first.here.read(place, 8192, 0)
    assert second.here.place(value) == place
    first.here.read(first.there.place(new), 8192, 0)
    assert second.here.place(value) != place
    first.to_host()
    assert first.there.place(new) != place  # the second host has not read it
    second.to_host()
    assert second.there.read(place, 8192, 0) == old
    second.to_orchestrator()
    first.to_host()
    assert first.there.place(new) == place


@pytest.mark.parametrize("length", [4096, 4097, 8192, 8193])
def test_neighbours_do_not_overlap(length: int) -> None:
    """Places are powers of two, so one byte too many for one takes the next."""
    arena = Arena(0)
    values = [bytes([number]) * length for number in range(20)]
    places = [arena.place(value) for value in values]
    assert [arena.segments[0].read(place, length) for place in places] == values
    arena.close()


def test_a_place_says_to_the_byte_where_something_is() -> None:
    segment = Segment.create(5, 1 << 13)
    segment.memory[:] = bytes(k % 251 for k in range(1 << 13))
    for offset in (0, 1, 2, 3, 4095, 4097, (1 << 13) - 2):
        place = 5 << OFFSET_BITS | offset
        assert segment.read(place, 2) == bytes([offset % 251, (offset + 1) % 251])
        found = segment.array(place, (2,), np.dtype(np.uint8))
        assert found.tolist() == [offset % 251, (offset + 1) % 251]
    last = 5 << OFFSET_BITS | (1 << 13) - 1
    with pytest.raises(PlaceError, match="2 bytes at 8191 of segment 5 do not exist"):
        segment.read(last, 2)
    segment.close()


def test_only_the_owner_can_write_and_nobody_can_cut_off() -> None:
    segment = Segment.create(1, 1 << 16)
    with pytest.raises(PermissionError):
        os.ftruncate(segment.descriptor, 1 << 12)
    if sys.platform == "linux" and fcntl.fcntl(segment.descriptor, fcntl.F_GET_SEALS) & 0x10:
        with pytest.raises(PermissionError):
            mmap.mmap(segment.descriptor, 1 << 16)
        with pytest.raises(PermissionError):
            os.pwrite(segment.descriptor, b"x", 0)
    segment.close()


def test_memory_that_could_be_cut_off_is_refused() -> None:
    descriptor = os.memfd_create("loose", os.MFD_ALLOW_SEALING)
    os.ftruncate(descriptor, 1 << 12)
    with pytest.raises(PlaceError, match="segment 4096 may become smaller"):
        Segment.attach(4096, 1 << 12, descriptor)
    with pytest.raises(PlaceError, match="segment 4096 of 8192 bytes is too small"):
        Segment.attach(4096, 1 << 13, descriptor)
    os.close(descriptor)


def test_places_that_a_host_invents_are_refused() -> None:
    exchange = Exchange()
    line, other = Line(exchange, 1), Line(exchange, 2)
    place, _ = line.made(np.zeros(LENGTH))
    with pytest.raises(PlaceError, match=f"place {place} is not one of host 2"):
        other.here.array(place, (LENGTH,), FLOAT)
    with pytest.raises(PlaceError, match="there is no segment 4097"):
        line.here.array(4097 << OFFSET_BITS, (LENGTH,), FLOAT)
    with pytest.raises(PlaceError, match=r"an array of float64\[2097153\] in segment 4096"):
        line.here.array(place, ((1 << 21) + 1,), FLOAT)
    with pytest.raises(PlaceError, match="16777217 bytes at 0 of segment 4096 do not exist"):
        line.here.read(place, (1 << 24) + 1, 0)
    with pytest.raises(PlaceError, match="nobody has a place 5"):
        line.here.arrive([5], [])
    with pytest.raises(PlaceError, match="segment 4096 is not one of host 2"):
        other.here.arrive([], [(4096, 1 << 24, 0)])
    with pytest.raises(PlaceError, match="segment 12288 is not one of host 2"):
        other.here.arrive([], [(3 << 12, 1 << 24, 0)])  # of a third, which nobody has yet
    with pytest.raises(PlaceError, match="segment 4096 is not one of host 1"):
        line.here.arrive([], [(4096, 1 << 24, 0)])  # twice: places in the first would move
    with pytest.raises(PlaceError, match="there is no place 5 here"):
        Arena(0).free(5)


def test_the_wire_puts_large_values_into_memory_and_small_ones_into_the_message() -> None:
    connectors = {
        "x": Connector(causality=Causality.INPUT, unit="1", shape=("n",)),
        "b": Connector(causality=Causality.INPUT, dtype=None, mime_type="a/b"),
    }
    line = Line(Exchange(), 1)
    encoder = SignalEncoder(connectors, line.here)
    decoder = SignalDecoder(connectors, line.there)
    for length in (line.here.least // 8 - 1, line.here.least // 8):
        values: dict[str, Signal] = {
            "x": np.arange(length, dtype=FLOAT),
            "b": bytes(8 * length),
        }
        message = b"".join(encoder.parts(values))
        line.to_host()
        decoded = decoder.decode(message)
        assert np.array_equal(decoded["x"], values["x"])
        assert decoded["b"] == values["b"]
        assert (len(message) < 200) == (8 * length >= line.here.least)
    with pytest.raises(WireError, match="no memory is shared with the peer"):
        SignalDecoder(connectors, NOTHING_SHARED).decode(message)
