"""What a component prints: the beginning goes to the log, the end into messages, the rest nowhere.

A component that floods its output must neither fill the disk nor slow the run down. Once its share
of the log is used up, what it prints is taken in large pieces, counted and dropped.
"""

import logging
import os
import sys
import threading
from contextlib import suppress
from time import sleep
from typing import IO, Final

from orchestrator.byte_size import format_size

if sys.platform == "linux":
    import fcntl

PRINTS: Final = __name__
"""The logger of what components print."""

_log = logging.getLogger(PRINTS)

KEPT: Final = 1_000_000
"""What of a component's output goes to the log [byte]."""

_LINES: Final = 20
"""Lines of output that a message quotes at most."""

_LONGEST_LINE: Final = 500
"""What of a line a message quotes at most."""

_LONGEST_ENTRY: Final = 10_000
"""A longer line is several entries of the log [byte]; also what is kept of the end."""

_ENTRY: Final = 100
"""What a line takes in the log beside itself [byte]; there are as many as fit once more."""

_PIECE: Final = 1 << 20
"""What is read at once, at most [byte]."""

_REST: Final = 0.002
"""How long output that is dropped may gather [s]: a thousand small pieces cost more than a large
one."""


class Output:
    """Takes what a process prints, in a thread of its own.

    Args:
        component: whose process it is.
        stream: what it prints; closed when that has ended.
        kept: what of it goes to the log at most [byte].
    """

    def __init__(self, component: str, stream: IO[bytes], kept: int = KEPT) -> None:
        self._component = component
        self._stream = stream
        self._left, self._entries = kept, kept // _ENTRY
        self._line = b""
        self._end = b""
        self._dropped = 0
        if sys.platform == "linux":
            with suppress(OSError):  # who has many pipes may have small ones only
                fcntl.fcntl(stream, fcntl.F_SETPIPE_SZ, _PIECE)
        self._thread = threading.Thread(target=self._read, name=f"{component} output", daemon=True)
        self._thread.start()

    def wait(self, timeout: float) -> None:
        """Wait up to `timeout` [s] for its end; a child of the process may hold it open."""
        self._thread.join(timeout)

    @property
    def last_lines(self) -> list[str]:
        """The last lines, each as far as it fits."""
        lines = self._end.decode(errors="replace").rstrip().split("\n")
        return [line.rstrip()[:_LONGEST_LINE] for line in lines[-_LINES:] if line.strip()]

    def _read(self) -> None:
        with self._stream:
            while piece := os.read(self._stream.fileno(), _PIECE):
                self._take(piece)
        self._log(self._line)
        if self._dropped:
            size, last = format_size(self._dropped), "\n    ".join(self.last_lines)
            what = "of output are left out here; the last lines were"
            _log.info("`%s`: %s %s:\n    %s", self._component, size, what, last)

    def _take(self, piece: bytes) -> None:
        self._end = (self._end + piece[-_LONGEST_ENTRY:])[-_LONGEST_ENTRY:]
        kept = piece[: self._left]
        self._left -= len(kept)
        self._dropped += len(piece) - len(kept)
        *lines, self._line = (self._line + kept).split(b"\n")
        for line in lines:
            if self._entries:
                self._log(line)
            else:
                self._left, self._dropped = 0, self._dropped + len(line) + 1
        if len(self._line) > _LONGEST_ENTRY or not self._left:
            self._log(self._line)
            self._line = b""
        if not kept:
            sleep(_REST)

    def _log(self, line: bytes) -> None:
        for start in range(0, len(line), _LONGEST_ENTRY):
            self._entries = max(0, self._entries - 1)
            text = line[start : start + _LONGEST_ENTRY].decode(errors="replace").rstrip()
            _log.info("`%s`: %s", self._component, text)
