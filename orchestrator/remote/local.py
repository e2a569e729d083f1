"""Processes of this machine, each at the other end of a socket pair; nobody else can reach it."""

import os
import socket
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
from orchestrator.remote.segment import PlaceError, can_share
from orchestrator.remote.sharing import NOTHING_SHARED, SharedMemory
from orchestrator.remote.socket_messages import SocketMessages, limit_waiting
from orchestrator.remote.transport import Link, LinkLostError, ProcessLink, Transport, dismiss

_SEND_TIMEOUT: Final = 60.0
"""How long a host may take to read its command, which it waits for [s]."""

_EXIT_AFTER_DISCONNECT: Final = 1.0
"""How long to wait for a better reason than a closed connection [s]."""


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
        self._messages = SocketMessages(self._socket, self._memory, self._beside)

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
        limit_waiting(self._socket, socket.SO_SNDTIMEO, _SEND_TIMEOUT)
        self._beside, theirs_beside = socket.socketpair()
        self._memory = LinkMemory(exchange, number) if number else NOTHING_SHARED
        self._messages = SocketMessages(self._socket, self._memory, self._beside)
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
