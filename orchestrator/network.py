"""How components on other hosts are reached: what a network between hosts has to offer.

The run meets each component at the endpoint of its host: it says what it knows of the component,
and is told what is known there. If both agree, they talk as with a process of this machine.
Entry points in the group `orchestrator.networks` offer networks; one of them is used, `zenoh`.
"""

import abc
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, Final, TypeAlias

from typing_extensions import override

from orchestrator.closing import Closing
from orchestrator.hosts_file import Hosts
from orchestrator.installed import installed_class
from orchestrator.limits import Deadlines
from orchestrator.remote.transport import Link, Transport
from orchestrator.statement import Statement

GROUP: Final = "orchestrator.networks"
USUAL: Final = "zenoh"

Records: TypeAlias = Sequence[tuple[str, int, str]]
"""Log records: the name of the logger, the level and the text of each."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Wanted:
    """A component that a run looks for on another host.

    Attributes:
        host: its name in the hosts file.
        statement: what the run says of the component.
        deadlines: of the component.
    """

    host: str
    statement: Statement
    deadlines: Deadlines

    @property
    def patience(self) -> float:
        """How long the other side is waited for at most [s]."""
        return max(self.deadlines.create, self.deadlines.setup, self.deadlines.step)


class HostsTransport(Transport):
    """Finds components on other hosts, waits until all are there, and ends when the run does."""

    @property
    @abc.abstractmethod
    def found(self) -> Mapping[str, Statement]:
        """What the hosts say of the components that were found, by name."""


class Visit(abc.ABC):
    """A run's use of one served component, as who serves it sees it."""

    @property
    @abc.abstractmethod
    def absence(self) -> float:
        """How long nothing is known of the run [s]; 0 while it is connected."""

    @property
    @abc.abstractmethod
    def is_over(self) -> bool:
        """Whether the run has said that it needs the component no more."""

    @abc.abstractmethod
    def receive(self, timeout: float) -> bytes:
        """The next command; empty when there will be none. One that is repeated is answered again.

        Args:
            timeout: how long to wait [s].

        Raises:
            TimeoutError: none came in time.
        """

    @abc.abstractmethod
    def send(self, reply: bytes) -> None:
        """Answer the command received last, without waiting: what cannot be said yet is later."""

    @abc.abstractmethod
    def lose(self, how: str) -> None:
        """Tell the run that the component is lost, likewise; `how` is a predicate."""

    @abc.abstractmethod
    def log(self, records: Records) -> None:
        """Have the run log these records."""

    @abc.abstractmethod
    def close(self) -> None:
        """End the use, whatever the run thinks of it."""


class Reception(abc.ABC):
    """Who serves components decides whether a run may use them; called from one other thread."""

    @property
    @abc.abstractmethod
    def names(self) -> tuple[str, ...]:
        """The components that are served."""

    @abc.abstractmethod
    def meet(self, component: str, request: Mapping[str, Any]) -> Mapping[str, Any]:
        """The answer, in terms of JSON, to a run that asks for a component.

        Args:
            component: any name; a stranger may ask.
            request: `run`, which no other one has, its `name` for people, its `statement` and its
                `patience` [s]. A run that did not hear the answer asks again.

        Returns:
            `statement`, and either `accepted`, or `wait` with a reason, or `refused` with reasons;
            beside `accepted`, `again` if the run was welcome before.
        """

    @abc.abstractmethod
    def welcome(self, component: str, request: Mapping[str, Any], visit: Visit) -> bool:
        """A run that `meet` accepted begins to use a component.

        Returns:
            Whether it does; if not, there is nothing to be had by now, and `visit` is closed.
        """


class Lobby(Closing):
    """Where runs come to; open from its creation on."""

    @abc.abstractmethod
    @override
    def close(self) -> None:
        """Let nobody in any more. Idempotent."""


class Network(abc.ABC):
    """A way between hosts. Created without arguments."""

    @abc.abstractmethod
    def transport(
        self, hosts: Hosts, wanted: Mapping[str, Wanted], run: str, tell: Callable[[str], None]
    ) -> HostsTransport:
        """The way to components on other hosts.

        Args:
            hosts: where they are.
            wanted: by name.
            run: its name, for people on the other side.
            tell: is called with a line whenever there is something new to wait for.
        """

    @abc.abstractmethod
    def lobby(self, hosts: Hosts, host: str, reception: Reception) -> Lobby:
        """Listen for runs at the endpoint of `host`, which is this one.

        Raises:
            ScenarioError: the endpoint or the credentials cannot be used.
        """


def network() -> Network:
    """The network in use.

    Raises:
        ComponentTypeError: it is not installed, or cannot be loaded.
    """
    return installed_class(GROUP, USUAL, Network, "network")()  # type: ignore[type-abstract]


class SeveralTransports(Transport):
    """Each component by the transport that knows it; the first of them is opened first.

    Args:
        parts: transports, each with the names of its components.
    """

    def __init__(self, parts: Sequence[tuple[Transport, frozenset[str]]]) -> None:
        self._parts = parts

    @override
    def admit(self, digests: Mapping[str, str]) -> None:
        for transport, known in self._parts:
            transport.admit({name: each for name, each in digests.items() if name in known})

    @override
    def open(self, names: Sequence[str], timeout: float) -> Mapping[str, Link]:
        found: dict[str, Link] = {}
        for transport, known in self._parts:
            found.update(transport.open([name for name in names if name in known], timeout))
        return MappingProxyType(found)

    @override
    def renew(self, name: str, timeout: float) -> Link:
        (transport,) = (each for each, known in self._parts if name in known)
        return transport.renew(name, timeout)

    @override
    def close(self) -> None:
        with ExitStack() as stack:
            for transport, _ in self._parts:
                stack.callback(transport.close)
