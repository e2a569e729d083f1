"""A server that shows one run to browsers; it only reads, and answers nobody else."""

import json
import re
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import ClassVar, Final

from typing_extensions import override

from orchestrator.errors import CosimError
from orchestrator.page.live.making import LivePages

_HERE: Final = Path(__file__).parent
_TYPES: Final = {
    ".html": "text/html; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".json": "application/json",
}
_FILES: Final = {"/": "live.html", "/live.css": "live.css", "/live.js": "live.js"}
_PAGE: Final = re.compile(r"/page/([0-9]{1,9})\.html")
_HEADERS: Final = {
    "Cache-Control": "no-store",
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
}
_POLICY: Final = (
    "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; frame-src 'self'"
)
_PATIENCE: Final = 10.0
"""How long somebody who connects may take to ask [s]."""

_NAMES: Final = frozenset({"localhost", "127.0.0.1", "[::1]"})


class LiveError(CosimError):
    """A run cannot be served. Exit code 2."""


@contextmanager
def served(pages: LivePages, host: str, port: int) -> Iterator[str]:
    """Show pages to browsers within the block; yields the address.

    Args:
        pages: of a run.
        host: address of this machine.
        port: 0: one that is free.

    Raises:
        LiveError: the address is taken, or is none of this machine.
    """
    handler = type("Handler", (_Handler,), {"pages": pages, "host": host})
    try:
        server = ThreadingHTTPServer((host, port), handler)
    except OSError as error:
        raise LiveError(f"cannot listen at {host}:{port}: {error.strerror or error}") from None
    server.daemon_threads = True
    thread = threading.Thread(target=server.serve_forever, name="pages", daemon=True)
    thread.start()
    try:
        yield f"http://{host}:{server.server_address[1]}/"
    finally:
        server.shutdown()
        server.server_close()
        thread.join()


class _Handler(BaseHTTPRequestHandler):
    pages: ClassVar[LivePages]
    host: ClassVar[str]
    timeout = _PATIENCE
    server_version = "nlosim"
    sys_version = ""

    def do_GET(self) -> None:
        """Answer."""
        if not self._is_asked_for():
            self._answer(HTTPStatus.FORBIDDEN, ".html", b"this server has another name")
            return
        path = self.path.partition("?")[0]
        if path in _FILES:
            file = _HERE / _FILES[path]
            self._answer(HTTPStatus.OK, file.suffix, file.read_bytes(), policy=_POLICY)
        elif path == "/state.json":
            state = json.dumps(asdict(self.pages.state())).encode()
            self._answer(HTTPStatus.OK, ".json", state)
        elif (found := _PAGE.fullmatch(path)) and (page := self.pages.page(int(found[1]))):
            self._answer(HTTPStatus.OK, ".html", page)
        else:
            self._answer(HTTPStatus.NOT_FOUND, ".html", b"there is nothing here")

    def _is_asked_for(self) -> bool:
        """Whether the browser knows us by our own name: no other site may read the run."""
        name = re.sub(r":[0-9]+$", "", self.headers.get("Host", ""))
        return name in _NAMES or name == self.host or self.host in {"0.0.0.0", "::"}  # noqa: S104

    def _answer(self, status: HTTPStatus, suffix: str, content: bytes, *, policy: str = "") -> None:
        self.send_response(status)
        for name, value in _HEADERS.items():
            self.send_header(name, value)
        if policy:
            self.send_header("Content-Security-Policy", policy)
        self.send_header("Content-Type", _TYPES[suffix])
        self.send_header("Content-Length", str(len(content)))
        self.end_headers()
        self.wfile.write(content)

    @override
    def log_message(self, format: str, *args: object) -> None:
        """Say nothing on the standard error."""
