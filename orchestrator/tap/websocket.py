"""WebSocket (RFC 6455), as much of it as a tap takes: one way, whole binary messages.

Browsers speak it without anything installed. The reader asks by HTTP and is then sent frames; what
it sends is looked at for the wish to close only.
"""

import base64
import hashlib
import struct
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Final
from urllib.parse import parse_qs, urlsplit

from orchestrator.errors import CosimError

_GUID: Final = "258EAFA5-E914-47DA-95CA-C5AB0DC85B11"
"""What RFC 6455, section 1.3, joins to the key of a request."""

_BINARY: Final = 0x2
_CLOSE: Final = 0x8
_FINAL: Final = 0x80
_LONGEST_REQUEST: Final = 8192

CLOSE: Final = bytes([_FINAL | _CLOSE, 0])
"""The last frame."""


class HandshakeError(CosimError):
    """A request or an answer is not what it should be.

    Attributes:
        status: what to answer, of HTTP.
    """

    def __init__(self, status: str, text: str) -> None:
        super().__init__(text)
        self.status = status

    @property
    def answer(self) -> bytes:
        """The answer to such a request."""
        body = f"{self}\n".encode()
        head = f"HTTP/1.1 {self.status}\r\nContent-Type: text/plain; charset=utf-8\r\n"
        return f"{head}Content-Length: {len(body)}\r\nConnection: close\r\n\r\n".encode() + body


@dataclass(frozen=True, slots=True)
class Request:
    """What a reader asks for.

    Attributes:
        path: of the resource.
        query: what is asked, each name with its values.
        key: by which the answer shows that it was understood.
    """

    path: str
    query: Mapping[str, list[str]]
    key: str

    @property
    def answer(self) -> bytes:
        """The answer that begins the frames."""
        return (
            "HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
            f"Sec-WebSocket-Accept: {accepted(self.key)}\r\n\r\n"
        ).encode()


def request_in(received: bytes) -> Request | None:
    """The request at the beginning of what was received; `None` until it is whole.

    Raises:
        HandshakeError: it is no request for a WebSocket.
    """
    head, end, _ = received.partition(b"\r\n\r\n")
    if len(head) > _LONGEST_REQUEST:
        raise HandshakeError("431 Request Header Fields Too Large", "the request is too long")
    if not end:
        return None
    first, *lines = head.decode("latin-1").split("\r\n")
    words = first.split(" ")
    if len(words) != 3 or not words[2].startswith("HTTP/1."):
        raise HandshakeError("400 Bad Request", "this is not HTTP")
    if words[0] != "GET":
        raise HandshakeError("405 Method Not Allowed", "a tap can be read only")
    named = (line.partition(":") for line in lines)
    fields = {name.strip().lower(): value.strip() for name, _, value in named}
    key = fields.get("sec-websocket-key", "")
    if fields.get("upgrade", "").lower() != "websocket" or not key:
        raise HandshakeError("426 Upgrade Required", "a tap speaks WebSocket")
    address = urlsplit(words[1])
    return Request(address.path, parse_qs(address.query), key)


def accepted(key: str) -> str:
    """What the answer to a request with this key says."""
    return base64.b64encode(hashlib.sha1(f"{key}{_GUID}".encode()).digest()).decode()  # noqa: S324


def framed(message: bytes) -> bytes:
    """One message as a frame of a server, which is not masked."""
    length = len(message)
    if length < 126:
        head = struct.pack(">BB", _FINAL | _BINARY, length)
    elif length < 1 << 16:
        head = struct.pack(">BBH", _FINAL | _BINARY, 126, length)
    else:
        head = struct.pack(">BBQ", _FINAL | _BINARY, 127, length)
    return head + message


class Frames:
    """Takes a stream of a server apart into messages.

    Attributes:
        is_closed: whether the server has said that it has nothing more to say.
    """

    def __init__(self) -> None:
        self._received = bytearray()
        self.is_closed = False

    def feed(self, received: bytes) -> Iterator[bytes]:
        """The messages that are whole now."""
        self._received += received
        while not self.is_closed and (frame := self._next()) is not None:
            opcode, payload = frame
            if opcode == _CLOSE:
                self.is_closed = True
            elif opcode == _BINARY:
                yield payload

    def _next(self) -> tuple[int, bytes] | None:
        got = self._received
        if len(got) < 2:
            return None
        length, start = got[1] & 0x7F, 2
        for short, size in ((126, 2), (127, 8)):
            if length == short:
                start += size
                if len(got) < start:
                    return None
                length = int.from_bytes(got[2:start], "big")
                break
        if len(got) < start + length:
            return None
        payload = bytes(got[start : start + length])
        opcode = got[0] & 0x0F
        del got[: start + length]
        return opcode, payload
