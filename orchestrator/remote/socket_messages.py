"""Whole messages over a socket pair, with what goes beside them.

In both directions: the length of a message, u64 little-endian, and the message. Where memory is
shared, there may be before it:

    u64: highest bit | count of places, bits 16 to 47 | count of segments, bits 0 to 15
    place u64 * places | number u64, size u64 * segments

The descriptors of these segments come over another socket pair, before: reading from a socket that
may have some takes longer, and segments are few.
"""

import socket
import struct
from collections.abc import Sequence
from time import monotonic
from typing import Final

from orchestrator.remote.segment import PlaceError, Segment
from orchestrator.remote.sharing import NOTHING_SHARED, SharedMemory

_HEAD: Final = struct.Struct("<Q")
_BESIDE: Final = 1 << 63
_SEGMENTS: Final = _BESIDE | 0xFFFF
"""What says that there is something before a message, and how many segments of it."""

_DESCRIPTORS: Final = 64
"""How many come with one message at most."""

_AT_ONCE: Final = 1.0
"""How long to wait for descriptors that were announced, and so sent [s]."""

_PIECE: Final = 1 << 20
"""What is read at once, at most [byte]: a length that is a lie takes no memory."""

_SMALL: Final = 1 << 16
"""A message of this length is read at once, with what says how long it is [byte]."""

_BUFFER: Final = 1 << 20
"""What the system may keep of a message that is on its way [byte]."""

_TIMEVAL: Final = struct.Struct("@ll")
"""Seconds and microseconds, as the system has them."""

_SLICE: Final = 0.05
"""How long a socket waits at a time: so late is noticed that a deadline is over [s]."""


def limit_waiting(blocking: socket.socket, option: int, time: float) -> None:
    """Have the system wait no longer than `time` [s], and Python not ask it twice for that."""
    whole, rest = divmod(round(time * 1e6), 1_000_000)
    blocking.setsockopt(socket.SOL_SOCKET, option, _TIMEVAL.pack(whole, rest))


class SocketMessages:
    """Whole messages over one end of a socket pair.

    What came of a message stays here when the waiting for the rest ends early.

    Args:
        connection: for messages; it blocks.
        memory: that both ends see.
        beside: for descriptors, if memory is shared.
    """

    def __init__(
        self,
        connection: socket.socket,
        memory: SharedMemory = NOTHING_SHARED,
        beside: socket.socket | None = None,
    ) -> None:
        self._memory = memory
        self._beside = beside
        self._wanted = _HEAD.size
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, _BUFFER)
        self._socket = connection
        self._is_limited = False
        self._length: int | None = None
        self._pieces: list[bytes] = []
        self._got = 0

    def send(self, message: bytes) -> None:
        """Send `message`; `OSError` if the other end is gone."""
        head = _HEAD.pack(len(message))
        places, segments = self._memory.leave()
        if places or segments:
            head = self._beside_of(places, segments) + head
        # in one piece, so that the other end is woken once
        if len(message) < _PIECE:
            self._socket.sendall(head + message)
        else:
            self._socket.sendall(head)
            self._socket.sendall(message)

    def receive(self, deadline: float | None) -> bytes:
        """The next message, by `deadline` on the clock of `time.monotonic` [s].

        What has come is taken, whatever the time is.

        Raises:
            TimeoutError: it is not complete in time.
            EOFError: the other end is gone.
            OSError: the other end is gone.
        """
        if deadline is not None:
            self.limit()
        if self._length is None and not self._got:
            start = self._next(_SMALL, deadline)
            whole = self._whole(start)
            if whole is not None:
                return whole
            self._keep(start)
        while self._length is None:
            if self._got < self._wanted:
                self._read(_SMALL, deadline)
            else:
                self._begin(self._pieces[0] if len(self._pieces) == 1 else b"".join(self._pieces))
        length = self._length
        while self._got < length:
            self._read(min(_PIECE, length - self._got), deadline)
        came, self._length = b"".join(self._pieces), None
        self._keep(came[length:])
        return came if len(came) == length else came[:length]

    def limit(self) -> None:
        """Have reading wait no longer than `_SLICE` at a time."""
        if not self._is_limited:
            limit_waiting(self._socket, socket.SO_RCVTIMEO, _SLICE)
            self._is_limited = True

    def unread(self, came: bytes) -> None:
        """Begin the next message with these bytes."""
        self._keep(came)

    def _whole(self, start: bytes) -> bytes | None:
        """The message, if that is what `start` is: most are alone, and come at once."""
        length, offset = len(start), _HEAD.size
        if length < offset:
            return None
        (head,) = _HEAD.unpack_from(start)
        if head & _SEGMENTS == _BESIDE:
            places = head >> 16 & 0xFFFFFFFF
            after = offset + 8 * places
            offset = after + _HEAD.size
            if length < offset or _HEAD.unpack_from(start, after)[0] != length - offset:
                return None
            self._memory.arrive(struct.unpack_from(f"<{places}Q", start, _HEAD.size), ())
        elif head != length - offset:
            return None
        return start[offset:]

    def _begin(self, start: bytes) -> None:
        """Read the length, and what there is before it once all of that is there."""
        (head,) = _HEAD.unpack_from(start)
        offset = _HEAD.size
        if head & _BESIDE:
            places, segments = head >> 16 & 0xFFFFFFFF, head & 0xFFFF
            after = offset + 8 * places + 16 * segments
            self._wanted = after + _HEAD.size
            if len(start) < self._wanted:
                return
            self._wanted = _HEAD.size
            numbers = struct.unpack_from(f"<{places + 2 * segments}Q", start, offset)
            self._arrive(numbers[:places], numbers[places::2], numbers[places + 1 :: 2])
            (head,) = _HEAD.unpack_from(start, after)
            offset = after + _HEAD.size
        self._length = head
        self._keep(start[offset:])

    def _arrive(self, places: Sequence[int], numbers: Sequence[int], sizes: Sequence[int]) -> None:
        descriptors = self._announced() if numbers else []
        if len(numbers) != len(descriptors):
            raise PlaceError(f"{len(numbers)} segments, but {len(descriptors)} descriptors")
        self._memory.arrive(places, list(zip(numbers, sizes, descriptors, strict=True)))

    def _announced(self) -> list[int]:
        if self._beside is None:
            return []
        self._beside.settimeout(_AT_ONCE)
        try:
            return socket.recv_fds(self._beside, 1, _DESCRIPTORS)[1]
        except OSError as error:
            raise PlaceError(f"no descriptors came: {error}") from None

    def _beside_of(self, places: Sequence[int], segments: Sequence[Segment]) -> bytes:
        """What is before a message, whose descriptors are sent."""
        described = [number for each in segments for number in (each.number, each.size)]
        count = _BESIDE | len(places) << 16 | len(segments)
        head = struct.pack(f"<{1 + len(places) + len(described)}Q", count, *places, *described)
        if segments and self._beside is not None:
            descriptors = [segment.descriptor for segment in segments]
            socket.send_fds(self._beside, [b"\0"], descriptors)
        return head

    def _keep(self, rest: bytes) -> None:
        self._pieces, self._got = ([rest] if rest else []), len(rest)

    def _read(self, most: int, deadline: float | None) -> None:
        piece = self._next(most, deadline)
        self._pieces.append(piece)
        self._got += len(piece)

    def _next(self, most: int, deadline: float | None) -> bytes:
        """The next bytes, at least one and at most so many."""
        while True:
            is_over = deadline is not None and monotonic() >= deadline
            try:
                piece = self._socket.recv(most, socket.MSG_DONTWAIT if is_over else 0)
            except BlockingIOError:
                if is_over:
                    raise TimeoutError from None
                continue
            if not piece:
                raise EOFError
            return piece
