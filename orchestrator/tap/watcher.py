"""One reader of a tap, as the run sees it: a socket that is never waited for."""

import secrets
import socket
from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import Final

from orchestrator.tap.stream import Kind, Message, Schema, Writer
from orchestrator.tap.websocket import CLOSE, HandshakeError, Request, framed, request_in

MOST_PER_SECOND: Final = 50.0
"""Messages that a reader gets at most, in a second of wall time."""

USUAL_PER_SECOND: Final = 10.0

EVERYTHING: Final = "*"
"""The pattern of a reader that names none."""

_PATIENCE: Final = 200
"""How often a reader is looked at before it must have said what it wants."""

_BUFFER: Final = 1 << 20
"""What the system may keep of messages that are on their way [byte]."""

_AT_ONCE: Final = 1 << 14
"""What is read at once [byte]: more than the longest request."""

_CLOSES: Final = 0x8


class Watcher:
    """A reader: first it asks, then it is sent messages, as fast as it takes them.

    Args:
        connection: to it.
        token: that it must know.
        schema_of: what a reader with these patterns is shown.

    Attributes:
        schema: what it is shown; `None` until it has asked.
        is_gone: whether it needs to be looked at no more.
        left_out: messages that it missed since the last one.
    """

    def __init__(
        self,
        connection: socket.socket,
        token: str,
        schema_of: Callable[[Sequence[str]], Schema],
    ) -> None:
        connection.setblocking(False)  # noqa: FBT003 - as Python has it
        with suppress(OSError):
            connection.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, _BUFFER)
        self._socket = connection
        self._token = token
        self._schema_of = schema_of
        self._asked = b""
        self._looks = 0
        self._pending = memoryview(b"")
        self._writer: Writer | None = None
        self._period = 1 / USUAL_PER_SECOND
        self._next = 0.0
        self.schema: Schema | None = None
        self.left_out = 0
        self.is_gone = False

    @property
    def is_behind(self) -> bool:
        """Whether it has not taken all that was sent."""
        return len(self._pending) > 0

    def look(self) -> None:
        """Take what it says, and send on what it has not taken yet."""
        try:
            received = self._socket.recv(_AT_ONCE)
            if not received or (self._writer is not None and received[0] & 0x0F == _CLOSES):
                self.close()
            elif self._writer is None:
                self._ask(received)
        except BlockingIOError:
            pass
        except OSError:
            self.close()
        self._looks += 1
        if self._writer is None and self._looks > _PATIENCE:
            self.close()
        self.flush()

    def is_due(self, now: float) -> bool:
        """Whether it is to be sent a message at `now` [s]; one that is behind misses it."""
        if self.is_gone or self._writer is None or now < self._next:
            return False
        self._next = now + self._period
        if self.is_behind:
            self.left_out += 1
            return False
        return True

    def send(self, message: Message) -> None:
        """Send a message, as far as the system takes it."""
        if self._writer is None or self.is_gone:
            return
        self.left_out = 0
        end = CLOSE if message.kind is Kind.END else b""
        self._send(framed(self._writer.encode(message)) + end)

    def flush(self) -> None:
        """Send on what it has not taken yet."""
        while self._pending and not self.is_gone:
            try:
                self._pending = self._pending[self._socket.send(self._pending) :]
            except BlockingIOError:
                return
            except OSError:
                self.close()

    def fileno(self) -> int:
        """The descriptor, for `select`."""
        return self._socket.fileno()

    def close(self) -> None:
        """Have nothing to do with it any more."""
        self.is_gone = True
        self._pending = memoryview(b"")
        self._socket.close()

    def _send(self, content: bytes) -> None:
        self._pending = memoryview(bytes(self._pending) + content if self._pending else content)
        self.flush()

    def _ask(self, received: bytes) -> None:
        self._asked += received
        try:
            request = request_in(self._asked)
            if request is not None:
                self._greet(request)
        except HandshakeError as error:
            self._send(error.answer)
            self.close()

    def _greet(self, request: Request) -> None:
        token = request.query.get("token", [""])[0]
        if request.path != "/tap":
            raise HandshakeError("404 Not Found", "there is `/tap` only")
        if not secrets.compare_digest(token.encode(), self._token.encode()):
            raise HandshakeError("403 Forbidden", "the token is wrong")
        try:
            rate = float(request.query.get("rate", [str(USUAL_PER_SECOND)])[0])
        except ValueError:
            rate = 0.0
        if not 0 < rate <= MOST_PER_SECOND:
            limits = f"more than 0 and at most {MOST_PER_SECOND:g} per second"
            raise HandshakeError("400 Bad Request", f"`rate` must be {limits}")
        self.schema = self._schema_of(request.query.get("key", [EVERYTHING]))
        self._period = 1 / rate
        self._writer = Writer(self.schema)
        self._send(request.answer + framed(self._writer.schema()))
