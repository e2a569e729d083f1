"""Whether anybody listens at an endpoint, found out without waiting."""

import errno
import select
import socket
from contextlib import suppress
from time import monotonic
from typing import Final

from orchestrator.hosts_file import HostEndpoint

_PAUSE: Final = 0.5
"""The time between two attempts [s]."""

_REFUSALS: Final = 4
"""So many in a row, and nobody listens there: a host that is merely cut off refuses nothing."""

_LONGEST: Final = 5.0
"""How long an attempt may take before there is another one [s]."""


class Knock:
    """Connects again and again to an endpoint, and hangs up.

    Args:
        endpoint: where.
    """

    def __init__(self, endpoint: HostEndpoint) -> None:
        self._endpoint = endpoint
        self._socket: socket.socket | None = None
        self._began = 0.0
        self._refusals = 0

    @property
    def is_refused(self) -> bool:
        """Whether the machine answers that nobody listens, several times in a row."""
        self._look()
        if self._socket is None and monotonic() - self._began >= _PAUSE:
            self._try()
        return self._refusals >= _REFUSALS

    def forget(self) -> None:
        """The connection is there again."""
        self._hang_up()
        self._refusals = 0

    def _try(self) -> None:
        self._began = monotonic()
        address = (self._endpoint.bare_address, self._endpoint.port)
        try:
            family, kind, _, _, where = socket.getaddrinfo(*address, type=socket.SOCK_STREAM)[0]
        except OSError:
            return
        self._socket = socket.socket(family, kind)
        self._socket.setblocking(False)  # noqa: FBT003 - as Python has it
        self._note(self._socket.connect_ex(where))

    def _look(self) -> None:
        if self._socket is None:
            return
        poll = select.select([], [self._socket], [self._socket], 0)
        if poll[1] or poll[2]:
            self._note(self._socket.getsockopt(socket.SOL_SOCKET, socket.SO_ERROR))
        elif monotonic() - self._began > _LONGEST:
            self._hang_up()

    def _note(self, result: int) -> None:
        if result in (errno.EINPROGRESS, errno.EWOULDBLOCK, errno.EAGAIN):
            return
        self._refusals = self._refusals + 1 if result == errno.ECONNREFUSED else 0
        self._hang_up()

    def _hang_up(self) -> None:
        if self._socket is not None:
            with suppress(OSError):
                self._socket.close()
            self._socket = None
