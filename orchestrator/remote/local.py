"""Processes of this machine, each at the other end of a socket pair; nobody else can reach it.

Over the socket, in both directions: the length of a message, u64 little-endian, and the message.
Where memory is shared, there may be before it:

    u64: highest bit | count of places, bits 16 to 47 | count of segments, bits 0 to 15
    place u64 * places | number u64, size u64 * segments

The descriptors of these segments come over another socket pair, before: reading from a socket that
may have some takes longer, and segments are few.
"""

import os
import socket
import struct
import sys
import threading
from collections.abc import Mapping, Sequence
from contextlib import suppress
from time import monotonic
from types import MappingProxyType
from typing import Final

from typing_extensions import override

from orchestrator.errors import ComponentTypeError
from orchestrator.remote.block import WireError
from orchestrator.remote.host import HostChannel
from orchestrator.remote.memory import Exchange, HostMemory, LinkMemory
from orchestrator.remote.process import HostProcess
from orchestrator.remote.segment import PlaceError, Segment, can_share
from orchestrator.remote.sharing import NOTHING_SHARED, SharedMemory
from orchestrator.remote.transport import Link, LinkLostError, ProcessLink, Transport, dismiss

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

_SEND_TIMEOUT: Final = 60.0
"""How long a host may take to read its command, which it waits for [s]."""

_TIMEVAL: Final = struct.Struct("@ll")
"""Seconds and microseconds, as the system has them."""

_SLICE: Final = 0.05
"""How long a socket waits at a time: so late is noticed that a deadline is over [s]."""

_EXIT_AFTER_DISCONNECT: Final = 1.0
"""How long to wait for a better reason than a closed connection [s]."""


def _limit(blocking: socket.socket, option: int, time: float) -> None:
    """Have the system wait no longer than `time` [s], and Python not ask it twice for that."""
    whole, rest = divmod(round(time * 1e6), 1_000_000)
    blocking.setsockopt(socket.SOL_SOCKET, option, _TIMEVAL.pack(whole, rest))


class _Messages:
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
            _limit(self._socket, socket.SO_RCVTIMEO, _SLICE)
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


class LocalChannel(HostChannel):
    """The host's end.

    Args:
        descriptor: of the socket, inherited from the orchestrator.
        beside: likewise of that for descriptors.
        number: of this host, from 1 on; 0: no memory is shared.
    """

    def __init__(self, *, descriptor: int, beside: int, number: int) -> None:
        for each in (descriptor, beside):
            os.set_inheritable(each, False)  # noqa: FBT003 - what a component starts lacks it
        self._socket = socket.socket(fileno=descriptor)
        self._beside = socket.socket(fileno=beside)
        self._memory = HostMemory(number) if number else NOTHING_SHARED
        self._messages = _Messages(self._socket, self._memory, self._beside)

    @property
    @override
    def memory(self) -> SharedMemory:
        return self._memory

    @override
    def receive(self) -> bytes:
        try:
            return self._messages.receive(None)
        except (EOFError, OSError):
            return b""  # the orchestrator is gone, or wants no more of us

    @override
    def send(self, reply: bytes) -> None:
        try:
            self._messages.send(reply)
        except OSError as error:
            sys.exit(f"the connection to the orchestrator is closed: {error.strerror}")

    @override
    def close(self) -> None:
        self._socket.close()
        self._beside.close()


class LocalLink(ProcessLink):
    """The link to one host, whose process it starts and does not wait for.

    Args:
        component: its name.
        number: of the host, from 1 on; 0: no memory is shared.
        exchange: of the values of all hosts.
        admits: what the host may create.
    """

    def __init__(self, component: str, number: int, exchange: Exchange, admits: str) -> None:
        self._socket, theirs = socket.socketpair()
        _limit(self._socket, socket.SO_SNDTIMEO, _SEND_TIMEOUT)
        self._beside, theirs_beside = socket.socketpair()
        self._memory = LinkMemory(exchange, number) if number else NOTHING_SHARED
        self._messages = _Messages(self._socket, self._memory, self._beside)
        self._obituary = ""
        self._lock = threading.Lock()  # a descriptor is not closed while another thread uses it
        with theirs, theirs_beside:
            descriptor, beside = theirs.fileno(), theirs_beside.fileno()
            self._process = HostProcess(
                component,
                LocalChannel,
                {"descriptor": descriptor, "beside": beside, "number": number},
                self._disconnect,
                admits=admits,
                descriptors=(descriptor, beside),
            )

    @property
    @override
    def memory(self) -> SharedMemory:
        return self._memory

    @property
    @override
    def descriptor(self) -> int | None:
        if self._memory is NOTHING_SHARED or self._obituary:
            return None
        self._messages.limit()
        return self._socket.fileno()

    @property
    @override
    def packs(self) -> bool:
        return True

    @override
    def unread(self, came: bytes) -> None:
        self._messages.unread(came)

    @override
    def send(self, message: bytes) -> None:
        if self._obituary:
            raise LinkLostError(self._obituary)
        try:
            self._messages.send(message)
        except BlockingIOError:
            self._obituary = f"its process did not take a command within {_SEND_TIMEOUT:g} s"
            raise LinkLostError(self._obituary) from None
        except OSError:
            raise self._lost() from None

    @override
    def receive(self, timeout: float) -> bytes:
        try:
            return self._messages.receive(monotonic() + timeout)
        except TimeoutError:
            raise
        except PlaceError as error:
            raise WireError(str(error)) from None
        except (EOFError, OSError):
            raise self._lost() from None

    @override
    def abandon(self) -> None:
        self._process.kill()
        self._obituary = self._obituary or "its process was ended by the orchestrator"
        with self._lock:
            self._socket.close()
            self._beside.close()

    @override
    def dismiss(self) -> None:
        with suppress(OSError):
            self._socket.shutdown(socket.SHUT_WR)

    def _lost(self) -> LinkLostError:
        if not self._obituary:
            has_ended = self._process.wait(_EXIT_AFTER_DISCONNECT)
            closed = (
                f"lost the connection to its process, which closed it{self._process.last_words()}"
            )
            self._obituary = self._process.obituary() if has_ended else closed
        return LinkLostError(self._obituary)

    def _disconnect(self) -> None:
        """End all waiting: a child of the host, which ended, may hold the other end still."""
        with self._lock, suppress(OSError):
            self._socket.shutdown(socket.SHUT_RDWR)


class LocalTransport(Transport):
    """One process per component on this machine, at the other end of a socket pair.

    On Linux large values are in memory that all processes of the run see; elsewhere, and with
    `shares=False`, they travel over the sockets. It needs nothing but the operating
    system, which is POSIX: Windows cannot hand a socket over.
    """

    def __init__(self, *, shares: bool = True) -> None:
        self._shares = shares and can_share()
        self._exchange = Exchange()
        self._count = 0
        self._admitted: dict[str, str] = {}
        self._links: dict[str, LocalLink] = {}

    @override
    def admit(self, digests: Mapping[str, str]) -> None:
        self._admitted.update(digests)

    @override
    def open(self, names: Sequence[str], timeout: float) -> Mapping[str, Link]:
        if sys.platform == "win32":
            raise ComponentTypeError(
                "the transport `local` is not available on Windows; `zenoh` is"
            )
        for name in names:
            self.renew(name, timeout)
        # A host that does not start is found out by the reply to its first command, which waits
        # in the socket until the host reads it.
        return MappingProxyType(self._links)

    @override
    def renew(self, name: str, timeout: float) -> Link:
        self._count += 1
        number = self._count if self._shares else 0
        self._links[name] = LocalLink(name, number, self._exchange, self._admitted.get(name, ""))
        return self._links[name]

    @override
    def close(self) -> None:
        links, self._links = self._links, {}
        try:
            dismiss(links.values())
        finally:
            self._exchange.close()
