"""How the hosts of components are reached: bytes there, bytes back, and news of their death.

A transport knows nothing of components, signals or time, so it can be replaced: the loopback
here, Zenoh in `adapters`. Entry points in the group `orchestrator.transports` offer others.
"""

import abc
from collections.abc import Collection, Mapping, Sequence
from time import monotonic
from types import MappingProxyType
from typing import ClassVar, Final

from typing_extensions import override

from orchestrator.closing import Closing
from orchestrator.errors import CosimError
from orchestrator.remote.host import ComponentHost
from orchestrator.remote.process import HostProcess
from orchestrator.remote.sharing import NOTHING_SHARED, SharedMemory

GRACE: Final = 0.5
"""How long hosts may take, together, to leave in their own way [s]."""


class LinkLostError(CosimError):
    """The host at the other end of a link is gone; the text says how, as a predicate."""


class Link(abc.ABC):
    """The way to the host of one component: one command there, one reply back."""

    @property
    def memory(self) -> SharedMemory:
        """What this process and the host both see."""
        return NOTHING_SHARED

    @property
    def site(self) -> str:
        """Where the host is, if values that other hosts there gave can be named to it; or empty."""
        return ""

    @property
    def condition(self) -> str:
        """What is known to be wrong with the link, which may pass; empty if nothing is."""
        return ""

    @property
    def descriptor(self) -> int | None:
        """That of a socket to a host that shares memory, for who sends and reads messages himself.

        In front of each is its length, as eight bytes. Reading waits for a short time at most.
        `None`, the default, if there is none.
        """
        return None

    @property
    def packs(self) -> bool:
        """Whether the way is so short that it matters how long messages are made and read."""
        return False

    def unread(self, came: bytes) -> None:
        """Let the next reply begin with what was read from `descriptor`."""
        del came

    @abc.abstractmethod
    def send(self, message: bytes) -> None:
        """Send a command; do not wait for the reply.

        Raises:
            LinkLostError: the host is known to be gone.
        """

    @abc.abstractmethod
    def receive(self, timeout: float) -> bytes:
        """The next reply.

        Args:
            timeout: how long to wait [s].

        Raises:
            TimeoutError: none came in time.
            LinkLostError: the host is gone, known within milliseconds of its death.
        """

    @abc.abstractmethod
    def abandon(self) -> None:
        """End the host at once, without asking it: it hangs, or was interrupted."""

    @abc.abstractmethod
    def limit_memory(self, limit: int | None) -> None:
        """End the host when it has more than `limit` [byte] of memory for itself.

        Where the host has no process of its own, nothing is limited.
        """


class ProcessLink(Link):
    """The link to a host that is a process on this machine, started by this one."""

    _process: HostProcess

    @abc.abstractmethod
    def dismiss(self) -> None:
        """Tell the host that there are no more commands; it leaves once it has answered."""

    @override
    def limit_memory(self, limit: int | None) -> None:
        if limit is not None:
            self._process.limit_memory(limit)

    def has_left(self, timeout: float) -> bool:
        """Wait up to `timeout` [s] for the process to end; whether it has."""
        return self._process.wait(timeout)


def dismiss(links: Collection[ProcessLink]) -> None:
    """Let the hosts leave in their own way, and end those that take longer than `GRACE`."""
    try:
        for link in links:
            link.dismiss()
        deadline = monotonic() + GRACE
        for link in links:
            link.has_left(max(0.0, deadline - monotonic()))
    finally:
        for link in links:
            link.abandon()


class Transport(Closing):
    """Starts hosts for components, connects to them, and ends them.

    No host outlives `close`, nor the process that called `open`, however that ends.

    Attributes:
        makes_processes: whether each host is in a process of its own.
    """

    makes_processes: ClassVar[bool] = True

    def admit(self, digests: Mapping[str, str]) -> None:
        """Say, before it is started, what a host may create; hosts in this process need not know.

        Args:
            digests: of what is to be created, by component, see `orchestrator.remote.admission`.
                What was said of other components stays.
        """

    @abc.abstractmethod
    def open(self, names: Sequence[str], timeout: float) -> Mapping[str, Link]:
        """Start one host for each name, all at the same time, and wait until they can be reached.

        Args:
            names: of the components; unique.
            timeout: how long all of this may take [s].

        Raises:
            ComponentError: a host did not start; it says which, and what it said last.
        """

    @abc.abstractmethod
    def renew(self, name: str, timeout: float) -> Link:
        """Start another host in place of one that was abandoned, as `open` does.

        Args:
            name: of the component.
            timeout: how long this may take [s].

        Raises:
            ComponentError: it did not start.
        """

    @abc.abstractmethod
    @override
    def close(self) -> None:
        """End all hosts: those that listen in their own way, the others by force. Idempotent."""


class LoopbackTransport(Transport):
    """Hosts in this process, but through the same bytes as anywhere else.

    It shows that encoding changes nothing, without processes or a network.
    """

    makes_processes = False

    def __init__(self) -> None:
        self._links: dict[str, _LoopbackLink] = {}

    @override
    def open(self, names: Sequence[str], timeout: float) -> Mapping[str, Link]:
        self._links = {name: _LoopbackLink() for name in names}
        return MappingProxyType(self._links)

    @override
    def renew(self, name: str, timeout: float) -> Link:
        self._links[name] = _LoopbackLink()
        return self._links[name]

    @override
    def close(self) -> None:
        links, self._links = self._links, {}
        for link in links.values():
            link.abandon()


class _LoopbackLink(Link):
    def __init__(self) -> None:
        self._host = ComponentHost()
        self._reply: bytes | None = None

    @override
    def send(self, message: bytes) -> None:
        self._reply = self._host.handle(message)

    @override
    def receive(self, timeout: float) -> bytes:
        if self._reply is None:
            raise TimeoutError
        reply, self._reply = self._reply, None
        return reply

    @override
    def abandon(self) -> None:
        self._host.close()

    @override
    def limit_memory(self, limit: int | None) -> None:
        pass
