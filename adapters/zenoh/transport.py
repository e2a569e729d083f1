"""The orchestrator's end: a Zenoh peer that hosts connect to, and the processes they live in."""

import secrets
import socket
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Final

import zenoh
from typing_extensions import override

from adapters.zenoh.access import Peer, access
from adapters.zenoh.link import ZenohLink
from adapters.zenoh.session import LEASE, Keys, close_session, open_session
from orchestrator.errors import ComponentError
from orchestrator.remote.patience import Patience
from orchestrator.remote.transport import Link, Transport, dismiss

_PORT_ATTEMPTS: Final = 20


@dataclass(frozen=True, slots=True, eq=False)
class _Room:
    """A session that listens, and the passwords of those who may come in, by component."""

    session: zenoh.Session
    endpoint: str
    passwords: Mapping[str, str]


class ZenohTransport(Transport):
    """Spawns one process per component on this machine and talks to them over Zenoh.

    The hosts connect to the orchestrator's session on the loopback interface, each with a password
    of its own that exists for this run only, and may say and hear what belongs to its component
    (`adapters.zenoh.access`). A death is noticed by the operating system (the
    process ended). A connection that ends while the process lives is made again.

    Args:
        lease: how long either end may be silent before the connection counts as lost [s].

    Attributes:
        endpoint: where its session listens, e.g. `tcp/127.0.0.1:41234`; the newest one;
            empty while there is none.
    """

    def __init__(self, *, lease: float = LEASE) -> None:
        self.endpoint = ""
        self._lease = lease
        self._admitted: dict[str, str] = {}
        self._links: dict[str, ZenohLink] = {}
        self._rooms: dict[str, _Room] = {}
        self._is_open = False

    @override
    def admit(self, digests: Mapping[str, str]) -> None:
        self._admitted.update(digests)

    @override
    def open(self, names: Sequence[str], timeout: float) -> Mapping[str, Link]:
        patience = Patience(timeout)
        self._is_open = True
        if names:
            self._listen(names)
        for name in names:
            self._links[name] = self._start(name)
        for link in self._links.values():
            link.await_connection(patience)
        return MappingProxyType(self._links)

    @override
    def renew(self, name: str, timeout: float) -> Link:
        if not self._is_open:
            raise ComponentError(name, None, "the session is closed")
        if name not in self._rooms:  # who may come in is fixed when a session is opened
            self._listen([name])
        link = self._start(name)
        self._links[name] = link
        link.await_connection(Patience(timeout))
        return link

    @override
    def close(self) -> None:
        links, self._links = self._links, {}
        rooms, self._rooms = self._rooms, {}
        self._is_open = False
        try:
            dismiss(links.values())
        finally:
            for room in dict.fromkeys(rooms.values()):
                close_session(room.session)

    def _start(self, name: str) -> ZenohLink:
        room = self._rooms[name]
        run = secrets.token_hex(8)  # of its own: whoever had the name before is not heard
        options = {
            "endpoint": room.endpoint,
            "run": run,
            "component": name,
            "user": name,
            "password": room.passwords[name],
            "lease": self._lease,
        }
        keys, admits = Keys(run, name), self._admitted.get(name, "")
        return ZenohLink(room.session, keys, name, options, admits)

    def _listen(self, names: Sequence[str]) -> None:
        """Have a session listen on a free port of the loopback interface, to these hosts only."""
        passwords = {name: secrets.token_hex(16) for name in names}
        peers = [Peer(components=[name], user=name) for name in names]
        # The folder is readable by this user only. Zenoh reads the file once, so it can go before
        # anything can kill this process and leave it behind.
        with tempfile.TemporaryDirectory(prefix="nlosim-") as folder:
            users = Path(folder) / "users"
            users.write_text("".join(f"{name}:{word}\n" for name, word in passwords.items()))
            for attempt in range(_PORT_ATTEMPTS):
                self.endpoint = f"tcp/127.0.0.1:{_free_port()}"
                settings = {
                    "mode": "peer",
                    "listen/endpoints": [self.endpoint],
                    "transport/link/tx/lease": int(1000 * self._lease),
                    "transport/auth/usrpwd/dictionary_file": str(users),
                    **access(peers),
                }
                try:
                    session = open_session(settings)
                    break
                except zenoh.ZError:
                    # somebody else took the port in between
                    if attempt == _PORT_ATTEMPTS - 1:
                        raise
        self._rooms.update(dict.fromkeys(names, _Room(session, self.endpoint, passwords)))


def _free_port() -> int:
    """A port that was free a moment ago; Zenoh cannot say which one it chose for port 0."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port: int = probe.getsockname()[1]
        return port
