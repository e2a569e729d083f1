"""The orchestrator's end: a Zenoh peer that hosts connect to, and the processes they live in."""

import secrets
import socket
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from time import monotonic
from types import MappingProxyType
from typing import Final

import zenoh
from typing_extensions import override

from adapters.zenoh.link import ZenohLink
from adapters.zenoh.session import LEASE, Keys, close_session, open_session
from orchestrator.errors import ComponentError
from orchestrator.remote.transport import Link, Transport, dismiss

_USER: Final = "host"
_PORT_ATTEMPTS: Final = 20


class ZenohTransport(Transport):
    """Spawns one process per component on this machine and talks to them over Zenoh.

    The hosts connect to the orchestrator's session on the loopback interface, with a password
    that exists for this run only. A death is noticed by the operating system (the
    process ended). A connection that ends while the process lives is made again.

    Args:
        lease: how long either end may be silent before the connection counts as lost [s].

    Attributes:
        endpoint: where the orchestrator's session listens, e.g. `tcp/127.0.0.1:41234`.
    """

    def __init__(self, *, lease: float = LEASE) -> None:
        self.endpoint = ""
        self._lease = lease
        self._password = secrets.token_hex(16)
        self._links: dict[str, ZenohLink] = {}
        self._session: zenoh.Session | None = None

    @override
    def open(self, names: Sequence[str], timeout: float) -> Mapping[str, Link]:
        deadline = monotonic() + timeout
        self._session = self._listen(self._password)
        for name in names:
            self._links[name] = self._start(self._session, name)
        for link in self._links.values():
            link.await_connection(deadline)
        return MappingProxyType(self._links)

    @override
    def renew(self, name: str, timeout: float) -> Link:
        if self._session is None:
            raise ComponentError(name, None, "the session is closed")
        link = self._start(self._session, name)
        self._links[name] = link
        link.await_connection(monotonic() + timeout)
        return link

    @override
    def close(self) -> None:
        links, self._links = self._links, {}
        try:
            dismiss(links.values())
        finally:
            if self._session is not None:
                close_session(self._session)
                self._session = None

    def _start(self, session: zenoh.Session, name: str) -> ZenohLink:
        run = secrets.token_hex(8)  # of its own: whoever had the name before is not heard
        options = {
            "endpoint": self.endpoint,
            "run": run,
            "component": name,
            "user": _USER,
            "password": self._password,
            "lease": self._lease,
        }
        return ZenohLink(session, Keys(run, name), name, options)

    def _listen(self, password: str) -> zenoh.Session:
        """A session that listens on a free port of the loopback interface."""
        # The folder is readable by this user only. Zenoh reads the file once, so it can go before
        # anything can kill this process and leave it behind.
        with tempfile.TemporaryDirectory(prefix="nlosim-") as folder:
            users = Path(folder) / "users"
            users.write_text(f"{_USER}:{password}\n")
            for attempt in range(_PORT_ATTEMPTS):
                self.endpoint = f"tcp/127.0.0.1:{_free_port()}"
                settings = {
                    "mode": "peer",
                    "listen/endpoints": [self.endpoint],
                    "transport/link/tx/lease": int(1000 * self._lease),
                    "transport/auth/usrpwd/dictionary_file": str(users),
                }
                try:
                    return open_session(settings)
                except zenoh.ZError:
                    # somebody else took the port in between
                    if attempt == _PORT_ATTEMPTS - 1:
                        raise
        raise AssertionError


def _free_port() -> int:
    """A port that was free a moment ago; Zenoh cannot say which one it chose for port 0."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port: int = probe.getsockname()[1]
        return port
