"""Who has which value in shared memory, so that its place is used again when nobody has it.

Every process writes into an arena of its own. What another process gets of it is a view, whose
end is noticed: the hosts tell the orchestrator with their next reply, and the orchestrator tells
the owner with its next command. The orchestrator forwards what one host made to others by its
place, and nothing is copied on the way.

Beside its arena, each end of a link may have memory that it writes anew in every step: it is in a
segment of its own, which goes to the other end and to nobody else.
"""

import weakref
from collections.abc import Callable, Sequence
from typing import Any, Final

import numpy as np
from typing_extensions import override

from orchestrator.remote.segment import OFFSET_BITS, Arena, PlaceError, Segment
from orchestrator.remote.sharing import SharedMemory
from orchestrator.signal import Array

_LEAST: Final = 1 << 16
"""Values smaller than this travel: a place costs more than copying them [byte]."""

_OWNER_BITS: Final = OFFSET_BITS + 12
_TO_HOSTS: Final = 1 << 11
"""What is reserved for a host belongs to its number and this; so many hosts a run has at most."""


class _Reserved:
    """Segments that are written again and again; their numbers count down from the last one.

    Args:
        owner: as of an `Arena`.
    """

    def __init__(self, owner: int) -> None:
        self._next = (owner << 12) + (1 << 12) - 1
        self._fresh: list[Segment] = []
        self._all: list[Segment] = []

    def reserve(self, size: int) -> tuple[int, Array]:
        segment = Segment.create(self._next, size)
        self._next -= 1
        self._fresh.append(segment)
        self._all.append(segment)
        return segment.number << OFFSET_BITS, np.frombuffer(segment.memory, np.uint8, size)

    def leave(self) -> Sequence[Segment]:
        """Those that the peer does not know yet."""
        fresh, self._fresh = self._fresh, []
        return fresh

    def close(self) -> None:
        while self._all:
            self._all.pop().close()


class _Held(weakref.ref[Array]):
    """A view that somebody has: where, and under which key it is registered."""

    __slots__ = ("key", "place")
    key: int
    place: int


class _Views:
    """Views of the memory of others that are alive in this process."""

    def __init__(self, ended: Callable[[int], None]) -> None:
        self._ended = ended
        self._held: dict[int, _Held] = {}
        self._segments: dict[int, Segment] = {}

    def attach(self, segments: Sequence[tuple[int, int, int]]) -> list[Segment]:
        """See further segments: number, size and descriptor of each."""
        found = [Segment.attach(*segment) for segment in segments]
        self._segments.update((segment.number, segment) for segment in found)
        return found

    def segment(self, place: int) -> Segment:
        """That of `place`."""
        segment = self._segments.get(place >> OFFSET_BITS)
        if segment is None:
            raise PlaceError(f"there is no segment {place >> OFFSET_BITS}")
        return segment

    def array(self, place: int, shape: tuple[int, ...], dtype: "np.dtype[Any]") -> Array:
        """A view, whose end will be told."""
        array = self.segment(place).array(place, shape, dtype)
        self.hold(array, place)
        return array

    def hold(self, array: Array, place: int) -> None:
        """Tell of the end of `array`, whose value is at `place`."""
        held = _Held(array, self._end)
        held.key, held.place = id(array), place
        self._held[held.key] = held

    def place_of(self, array: Array) -> int | None:
        """Where the value of this very array is, if it is known."""
        held = self._held.get(id(array))
        return None if held is None else held.place

    def mapped(self, place: int, size: int) -> Array:
        """A view that nobody counts."""
        return self.segment(place).array(place, (size,), np.dtype(np.uint8))

    def close(self) -> None:
        """Close the descriptors; whoever has a view keeps it."""
        while self._segments:
            self._segments.popitem()[1].close()

    def _end(self, held: "weakref.ref[Array]") -> None:
        assert isinstance(held, _Held)  # noqa: S101
        del self._held[held.key]
        self._ended(held.place)


class HostMemory(SharedMemory):
    """The host's end.

    Args:
        owner: its number; 0 is the orchestrator's.
    """

    least = _LEAST

    def __init__(self, owner: int) -> None:
        self._arena = Arena(owner)
        self._reserved = _Reserved(owner)
        self._announced = 0
        self._ended: list[int] = []
        self._views = _Views(self._ended.append)

    @override
    def place(self, value: Array | bytes) -> int:
        return self._arena.place(value)

    @override
    def array(self, place: int, shape: tuple[int, ...], dtype: "np.dtype[Any]") -> Array:
        return self._views.array(place, shape, dtype)

    @override
    def read(self, place: int, length: int, signal: int) -> bytes:
        del signal
        value = self._views.segment(place).read(place, length)
        self._ended.append(place)
        return value

    @override
    def reserve(self, size: int) -> tuple[int, Array]:
        return self._reserved.reserve(size)

    @override
    def mapped(self, place: int, size: int) -> Array:
        return self._views.mapped(place, size)

    @override
    def arrive(self, places: Sequence[int], segments: Sequence[tuple[int, int, int]]) -> None:
        for place in places:
            self._arena.free(place)
        if segments:
            self._views.attach(segments)

    @override
    def leave(self) -> tuple[list[int], Sequence[Segment]]:
        ended = self._ended[:]
        del self._ended[: len(ended)]
        fresh = self._arena.segments[self._announced :]
        self._announced += len(fresh)
        return ended, [*fresh, *self._reserved.leave()]


class Exchange:
    """The orchestrator's side of all links of a run."""

    def __init__(self) -> None:
        self._arena = Arena(0)
        self._holders: dict[int, int] = {}
        self._views = _Views(self._forget)
        self._segments: dict[int, Segment] = {}
        self._returned: dict[int, list[int]] = {}
        self._copies: dict[int, tuple[bytes, int]] = {}
        self._reserved: list[_Reserved] = []

    def offer(self, value: Array | bytes) -> int:
        """The place of an array of any shape, or of bytes, that one more host will have."""
        known = self._copied(value) if isinstance(value, bytes) else self._views.place_of(value)
        place = self._own(value) if known is None else known
        self._holders[place] += 1
        return place

    def array(self, place: int, shape: tuple[int, ...], dtype: "np.dtype[Any]") -> Array:
        """What a host made, to be held here: an array of `shape`."""
        array = self._views.array(place, shape, dtype)
        self._hold(place)
        return array

    def read(self, place: int, length: int) -> bytes:
        """A copy of what a host made; who is offered this very object gets the place of that.

        `forget` ends this: bytes do not tell when they end.
        """
        value = self._views.segment(place).read(place, length)
        self._hold(place)
        self._copies[id(value)] = value, place
        return value

    def forget(self, value: bytes) -> None:
        """What `read` gave is not offered any more."""
        _, place = self._copies.pop(id(value))
        self._forget(place)

    def mapped(self, place: int, size: int) -> Array:
        """What a host has reserved: uint8, shape (size,)."""
        return self._views.mapped(place, size)

    def reserved(self, host: int) -> _Reserved:
        """What is reserved for a host.

        Raises:
            PlaceError: there are too many hosts.
        """
        if host >= _TO_HOSTS:
            raise PlaceError(f"host {host} is one too many")
        found = _Reserved(host | _TO_HOSTS)
        self._reserved.append(found)
        return found

    def segment(self, place: int) -> Segment:
        """That of `place`, to be handed on."""
        return self._segments[place >> OFFSET_BITS]

    def attach(self, owner: int, segments: Sequence[tuple[int, int, int]]) -> None:
        """See further segments of a host.

        Raises:
            PlaceError: they are not its own.
        """
        for number, _, _ in segments:
            if number >> 12 != owner or number in self._segments:
                raise PlaceError(f"segment {number} is not one of host {owner}")
        for segment in self._views.attach(segments):
            self._segments[segment.number] = segment

    def release(self, place: int) -> None:
        """One of those who had a place does not need it any more.

        Raises:
            PlaceError: nobody had it.
        """
        if place not in self._holders:
            raise PlaceError(f"nobody has a place {place}")
        self._forget(place)

    def returned(self, owner: int) -> Sequence[int]:
        """Places of a host that nobody needs any more, since the last call."""
        return self._returned.pop(owner, ())

    def close(self) -> None:
        """Close all descriptors; arrays stay as long as somebody has them."""
        self._copies.clear()
        self._segments.clear()
        self._views.close()
        self._arena.close()
        while self._reserved:
            self._reserved.pop().close()

    def _copied(self, value: bytes) -> int | None:
        found = self._copies.get(id(value))
        return None if found is None else found[1]

    def _hold(self, place: int) -> None:
        self._holders[place] = self._holders.get(place, 0) + 1

    def _own(self, value: Array | bytes) -> int:
        """Copy a value of this process to a place; that of an array is known while it lives."""
        place = self._arena.place(value)
        newest = self._arena.segments[-1]
        self._segments.setdefault(newest.number, newest)
        self._holders[place] = 0
        if not isinstance(value, bytes):
            self._holders[place] = 1
            self._views.hold(value, place)
        return place

    def _forget(self, place: int) -> None:
        self._holders[place] -= 1
        if self._holders[place]:
            return
        del self._holders[place]
        owner = place >> _OWNER_BITS
        if owner:
            self._returned.setdefault(owner, []).append(place)
        else:
            self._arena.free(place)


class LinkMemory(SharedMemory):
    """The orchestrator's end of one link.

    Args:
        exchange: of all links.
        owner: the number of the host.
    """

    least = _LEAST

    def __init__(self, exchange: Exchange, owner: int) -> None:
        self._exchange = exchange
        self._owner = owner
        self._copies: dict[int, bytes] = {}
        self._seen: set[int] = set()
        self._fresh: list[Segment] = []
        self._reserved: _Reserved | None = None

    @override
    def reserve(self, size: int) -> tuple[int, Array]:
        if self._reserved is None:
            self._reserved = self._exchange.reserved(self._owner)
        place, memory = self._reserved.reserve(size)
        self._fresh += self._reserved.leave()
        return place, memory

    @override
    def mapped(self, place: int, size: int) -> Array:
        self._check(place)
        return self._exchange.mapped(place, size)

    @override
    def place(self, value: Array | bytes) -> int:
        place = self._exchange.offer(value)
        number = place >> OFFSET_BITS
        if number not in self._seen:
            self._seen.add(number)
            self._fresh.append(self._exchange.segment(place))
        return place

    @override
    def array(self, place: int, shape: tuple[int, ...], dtype: "np.dtype[Any]") -> Array:
        self._check(place)
        return self._exchange.array(place, shape, dtype)

    @override
    def read(self, place: int, length: int, signal: int) -> bytes:
        self._check(place)
        before = self._copies.pop(signal, None)
        if before is not None:
            self._exchange.forget(before)
        value = self._copies[signal] = self._exchange.read(place, length)
        return value

    @override
    def arrive(self, places: Sequence[int], segments: Sequence[tuple[int, int, int]]) -> None:
        if segments:
            self._exchange.attach(self._owner, segments)
        for place in places:
            self._exchange.release(place)

    @override
    def leave(self) -> tuple[Sequence[int], Sequence[Segment]]:
        fresh, self._fresh = self._fresh, []
        return self._exchange.returned(self._owner), fresh

    def _check(self, place: int) -> None:
        if place >> _OWNER_BITS != self._owner:
            raise PlaceError(f"place {place} is not one of host {self._owner}")
