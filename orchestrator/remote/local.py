"""Processes of this machine, each at the other end of a socket pair; nobody else can reach it.

Over the socket, in both directions: the length of a message, u64 little-endian, and the message.
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
from orchestrator.remote.host import HostChannel
from orchestrator.remote.process import HostProcess
from orchestrator.remote.transport import Link, LinkLostError, Transport

_HEAD: Final = struct.Struct("<Q")
_PIECE: Final = 1 << 20
"""What is read at once, at most [byte]: a length that is a lie takes no memory."""

_SMALL: Final = 1 << 16
"""A message of this length is read at once, with what says how long it is [byte]."""

_BUFFER: Final = 1 << 20
"""What the system may keep of a message that is on its way [byte]."""

_SEND_TIMEOUT: Final = 60.0
"""How long a host may take to read its command, which it waits for [s]."""

_EXIT_AFTER_DISCONNECT: Final = 1.0
"""How long to wait for a better reason than a closed connection [s]."""

_GRACE: Final = 0.5
"""How long hosts may take, together, to leave in their own way [s]."""


class _Messages:
    """Whole messages over one end of a socket pair.

    What came of a message stays here when the waiting for the rest ends early.
    """

    def __init__(self, connection: socket.socket) -> None:
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, _BUFFER)
        self._socket = connection
        self._length: int | None = None
        self._pieces: list[bytes] = []
        self._got = 0

    def send(self, message: bytes) -> None:
        """Send `message`; `OSError` if the other end is gone."""
        head = _HEAD.pack(len(message))
        if len(message) < _PIECE:
            self._socket.sendall(head + message)
        else:
            self._socket.sendall(head)
            self._socket.sendall(message)

    def receive(self, deadline: float | None) -> bytes:
        """The next message, by `deadline` on the clock of `time.monotonic` [s].

        Raises:
            TimeoutError: it is not complete in time.
            EOFError: the other end is gone.
            OSError: the other end is gone.
        """
        while self._length is None:
            if self._got < _HEAD.size:
                self._read(_SMALL, deadline)
                continue
            start = b"".join(self._pieces)
            (self._length,) = _HEAD.unpack_from(start)
            self._keep(start[_HEAD.size :])
        length = self._length
        while self._got < length:
            self._read(min(_PIECE, length - self._got), deadline)
        came, self._length = b"".join(self._pieces), None
        self._keep(came[length:])
        return came if len(came) == length else came[:length]

    def _keep(self, rest: bytes) -> None:
        self._pieces, self._got = [rest], len(rest)

    def _read(self, most: int, deadline: float | None) -> None:
        if deadline is not None:
            # 0 would mean: do not wait, and say so by another error
            self._socket.settimeout(max(1e-6, deadline - monotonic()))
        piece = self._socket.recv(most)
        if not piece:
            raise EOFError
        self._pieces.append(piece)
        self._got += len(piece)


class LocalChannel(HostChannel):
    """The host's end.

    Args:
        descriptor: of the socket, inherited from the orchestrator.
    """

    def __init__(self, *, descriptor: int) -> None:
        os.set_inheritable(descriptor, False)  # noqa: FBT003 - what a component starts lacks it
        self._socket = socket.socket(fileno=descriptor)
        self._messages = _Messages(self._socket)

    @override
    def receive(self) -> bytes:
        try:
            return self._messages.receive(None)
        except (EOFError, OSError):
            return b""  # the orchestrator is gone, or wants no more of us

    @override
    def send(self, reply: bytes) -> None:
        self._messages.send(reply)

    @override
    def close(self) -> None:
        self._socket.close()


class LocalLink(Link):
    """The link to one host, whose process it starts and does not wait for.

    Args:
        component: its name.
    """

    def __init__(self, component: str) -> None:
        self._socket, theirs = socket.socketpair()
        self._messages = _Messages(self._socket)
        self._obituary = ""
        self._lock = threading.Lock()  # a descriptor is not closed while another thread uses it
        with theirs:
            descriptor = theirs.fileno()
            self._process = HostProcess(
                component,
                LocalChannel,
                {"descriptor": descriptor},
                self._disconnect,
                descriptors=(descriptor,),
            )

    @override
    def send(self, message: bytes) -> None:
        if self._obituary:
            raise LinkLostError(self._obituary)
        try:
            self._socket.settimeout(_SEND_TIMEOUT)
            self._messages.send(message)
        except TimeoutError:
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
        except (EOFError, OSError):
            raise self._lost() from None

    @override
    def abandon(self) -> None:
        self._process.kill()
        self._obituary = self._obituary or "its process was ended by the orchestrator"
        with self._lock:
            self._socket.close()

    def dismiss(self) -> None:
        """Tell the host that there are no more commands; it leaves once it has answered."""
        with suppress(OSError):
            self._socket.shutdown(socket.SHUT_WR)

    def has_left(self, timeout: float) -> bool:
        """Wait up to `timeout` [s] for the process to end; whether it has."""
        return self._process.wait(timeout)

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

    It needs nothing but the operating system, which is POSIX: Windows cannot hand a socket over.
    """

    def __init__(self) -> None:
        self._links: dict[str, LocalLink] = {}

    @override
    def open(self, names: Sequence[str], timeout: float) -> Mapping[str, Link]:
        if sys.platform == "win32":
            raise ComponentTypeError(
                "the transport `local` is not available on Windows; `zenoh` is"
            )
        for name in names:
            self._links[name] = LocalLink(name)
        # A host that does not start is found out by the reply to its first command, which waits
        # in the socket until the host reads it.
        return MappingProxyType(self._links)

    @override
    def close(self) -> None:
        links, self._links = self._links, {}
        try:
            for link in links.values():
                link.dismiss()
            deadline = monotonic() + _GRACE
            for link in links.values():
                link.has_left(max(0.0, deadline - monotonic()))
        finally:
            for link in links.values():
                link.abandon()
