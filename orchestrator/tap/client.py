"""The reader's end of a tap, for Python."""

import os
import socket
from base64 import b64encode
from collections.abc import Iterator, Sequence
from time import monotonic
from typing import Final
from urllib.parse import urlencode

from typing_extensions import override

from orchestrator.closing import Closing
from orchestrator.tap.place import NoTapError, Place
from orchestrator.tap.websocket import Frames, accepted

_PIECE: Final = 1 << 18
_CONNECT: Final = 5.0
"""How long a connection may take [s]; the run answers at its next communication point."""


class TapClient(Closing):
    """Connects to the tap of a run; its messages come in their order.

    Args:
        place: of the tap.
        keys: patterns of the signals `component.connector` that are wanted.
        rate: messages that are wanted per second of wall time, at most.
        patience: how long the run may take to answer [s]; it does so between two steps.

    Raises:
        NoTapError: nobody listens there, or not to this.
    """

    def __init__(
        self, place: Place, keys: Sequence[str], rate: float, *, patience: float = 60.0
    ) -> None:
        nonce = b64encode(os.urandom(16)).decode()
        query = [("token", place.token), ("rate", f"{rate:g}"), *(("key", each) for each in keys)]
        request = (
            f"GET /tap?{urlencode(query)} HTTP/1.1\r\nHost: 127.0.0.1:{place.port}\r\n"
            "Upgrade: websocket\r\nConnection: Upgrade\r\n"
            f"Sec-WebSocket-Key: {nonce}\r\nSec-WebSocket-Version: 13\r\n\r\n"
        )
        try:
            self._socket = socket.create_connection(("127.0.0.1", place.port), _CONNECT)
        except OSError:
            raise NoTapError("nobody listens at the tap; the run has ended") from None
        self._frames = Frames()
        try:
            self._socket.sendall(request.encode())
            self._rest = self._answered(accepted(nonce), patience)
        except OSError as error:
            self._socket.close()
            raise NoTapError(f"the run did not answer: {error}") from None
        except NoTapError:
            self._socket.close()
            raise

    def messages(self, timeout: float | None = None) -> Iterator[bytes]:
        """Each message as it comes, until the run ends it.

        Args:
            timeout: how long to read in all [s]; `None`: to the end.
        """
        deadline = None if timeout is None else monotonic() + timeout
        yield from self._frames.feed(self._rest)
        self._rest = b""
        while not self._frames.is_closed:
            left = None if deadline is None else deadline - monotonic()
            if left is not None and left <= 0:
                return
            self._socket.settimeout(left)
            try:
                received = self._socket.recv(_PIECE)
            except TimeoutError:
                return
            except OSError:
                received = b""
            if not received:
                return
            yield from self._frames.feed(received)

    @override
    def close(self) -> None:
        """Look no more."""
        self._socket.close()

    def _answered(self, expected: str, patience: float) -> bytes:
        """Read the answer to the request; what came after it."""
        self._socket.settimeout(patience)
        received = b""
        while b"\r\n\r\n" not in received:
            piece = self._socket.recv(_PIECE)
            if not piece:
                raise NoTapError("the run ended before it answered")
            received += piece
        head, _, rest = received.partition(b"\r\n\r\n")
        text = head.decode("latin-1")
        if " 101 " not in text.partition("\r\n")[0] + " ":
            why = rest.decode(errors="replace").strip() or text.partition("\r\n")[0]
            raise NoTapError(f"the run refused: {why}")
        if expected not in text:
            raise NoTapError("what answered is not the tap of a run")
        return rest
