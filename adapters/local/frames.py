"""Messages over a stream socket, with descriptors and places beside them.

    frame: length of the message u64 | count of places u32 | count of segments u32
           place u64 * places        what the sender does not need any more
           number u64, size u64 * segments   new ones, whose descriptors come along
           message
"""

import array
import socket
import struct
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

from adapters.local.segment import Segment
from orchestrator.remote.wire import WireError

_HEAD: Final = struct.Struct("<QII")
_SMALL: Final = 1 << 16
"""Read at once; a message that is larger takes more reads."""

_MOST_DESCRIPTORS: Final = 128
_ANCILLARY: Final = socket.CMSG_SPACE(4 * _MOST_DESCRIPTORS) if hasattr(socket, "CMSG_SPACE") else 0
_BUFFER: Final = 1 << 20
"""What the system may keep of a message that is on its way [byte]."""


@dataclass(frozen=True, slots=True)
class Frame:
    """What came in one message.

    Attributes:
        message: the message itself.
        places: what the sender does not need any more.
        segments: new ones: number, size [byte] and descriptor.
    """

    message: bytes
    places: Sequence[int]
    segments: Sequence[tuple[int, int, int]]


class FramedSocket:
    """Sends and receives frames.

    Args:
        connection: a connected stream socket, of which this is the only user.
        waiting: called again and again while nothing moves; what it raises ends the waiting. A
            socket with a timeout calls it after each, one without never.
    """

    def __init__(self, connection: socket.socket, waiting: Callable[[], None]) -> None:
        for option in (socket.SO_SNDBUF, socket.SO_RCVBUF):
            connection.setsockopt(socket.SOL_SOCKET, option, _BUFFER)
        self.socket = connection
        self._waiting = waiting
        self._takes_descriptors = connection.family == getattr(socket, "AF_UNIX", None)
        self._buffer = bytearray(_SMALL)
        self._view = memoryview(self._buffer)
        self._descriptors: list[int] = []

    def send(
        self, message: bytes, places: Sequence[int] = (), segments: Sequence[Segment] = ()
    ) -> None:
        """Send one frame.

        Raises:
            OSError: the other end is gone.
        """
        head = _HEAD.pack(len(message), len(places), len(segments))
        if places or segments:
            described = [number for s in segments for number in (s.number, s.size)]
            head += struct.pack(f"<{len(places) + len(described)}Q", *places, *described)
        if segments:
            descriptors = array.array("i", [segment.descriptor for segment in segments])
            passed = [(socket.SOL_SOCKET, socket.SCM_RIGHTS, descriptors)]
            sent = self._retry(lambda: self.socket.sendmsg([head[:1]], passed))
            head = head[sent:]
        if len(message) < _SMALL:
            self._send_all(memoryview(head + message))
        else:
            self._send_all(memoryview(head))
            self._send_all(memoryview(message))

    def receive(self) -> Frame:
        """The next frame.

        Raises:
            EOFError: the other end is gone.
            OSError: the other end is gone.
            WireError: what came is no frame.
        """
        got = self._read_until(self._view, 0, _HEAD.size)
        length, places, segments = _HEAD.unpack_from(self._buffer)
        if max(places, segments) > 1 << 20:
            raise WireError(f"a frame with {places} places and {segments} segments")
        start = _HEAD.size + 8 * places + 16 * segments
        if start + length <= got:
            return self._frame(bytes(self._view[start : start + length]), places, segments)
        if start > _SMALL:
            self._grow(start)
        got = self._read_until(self._view, got, start)
        message = bytearray(length)
        whole = memoryview(message)
        whole[: got - start] = self._view[start:got]
        self._read_until(whole, got - start, length)
        return self._frame(bytes(message), places, segments)

    def close(self) -> None:
        """Close the socket."""
        self.socket.close()

    def _frame(self, message: bytes, places: int, segments: int) -> Frame:
        if not (places or segments):
            return Frame(message, (), ())
        numbers = struct.unpack_from(f"<{places + 2 * segments}Q", self._buffer, _HEAD.size)
        described = numbers[places:]
        if len(self._descriptors) < segments:
            raise WireError(f"{segments} segments, but {len(self._descriptors)} descriptors")
        taken, self._descriptors = self._descriptors[:segments], self._descriptors[segments:]
        found = list(zip(described[::2], described[1::2], taken, strict=True))
        return Frame(message, numbers[:places], found)

    def _grow(self, size: int) -> None:
        larger = bytearray(size)
        larger[: len(self._buffer)] = self._buffer
        self._buffer, self._view = larger, memoryview(larger)

    def _read_until(self, view: memoryview, got: int, wanted: int) -> int:
        """Fill `view` from `got` on, to `wanted` bytes at least; how many there are."""
        while got < wanted:
            part = view[got:]
            received = self._retry(lambda part=part: self._read(part))  # type: ignore[misc]
            if not received:
                raise EOFError
            got += received
        return got

    def _read(self, view: memoryview) -> int:
        if not self._takes_descriptors:
            return self.socket.recv_into(view)
        received, ancillary, _, _ = self.socket.recvmsg_into([view], _ANCILLARY)
        for _, kind, data in ancillary:
            if kind == socket.SCM_RIGHTS:
                whole = len(data) - len(data) % 4
                self._descriptors += array.array("i", data[:whole])
        return received

    def _send_all(self, data: memoryview) -> None:
        while data:
            part = data
            data = data[self._retry(lambda part=part: self.socket.send(part)) :]  # type: ignore[misc]

    def _retry(self, call: Callable[[], int]) -> int:
        while True:
            try:
                return call()
            except TimeoutError:
                self._waiting()
