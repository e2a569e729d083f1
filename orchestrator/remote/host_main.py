"""`python -m orchestrator.remote.host_main`: a process that hosts one component.

It is started by `orchestrator.remote.process`, which says how the two agree; never by hand.
"""

import faulthandler
import importlib
import json
import logging
import os
import signal
import sys
import threading
from typing import TYPE_CHECKING, Any, Final

from typing_extensions import override

from orchestrator import leaving
from orchestrator.remote.guard import guarded

if TYPE_CHECKING:
    from orchestrator.remote.host import HostChannel

_MAX_RECORDS: Final = 1000
"""Log records kept between two replies; more than these are counted, not kept."""


class RecordCollector(logging.Handler):
    """Keeps log records until they can travel with a reply."""

    def __init__(self) -> None:
        super().__init__()
        self._records: list[tuple[str, int, str]] = []
        self._dropped = 0

    @override
    def emit(self, record: logging.LogRecord) -> None:
        if len(self._records) < _MAX_RECORDS:
            self._records.append((record.name, record.levelno, self.format(record)))
        else:
            self._dropped += 1

    def drain(self) -> list[tuple[str, int, str]]:
        """The records since the last call."""
        if not self._records:
            return []
        self.acquire()  # against `emit` in another thread
        records, self._records = self._records, []
        dropped, self._dropped = self._dropped, 0
        self.release()
        if dropped:
            text = f"{dropped} more log records were dropped"
            records.append((__name__, logging.WARNING, text))
        return records


def main() -> int:
    """Host one component until there are no more commands."""
    guarded(lifeline=0)
    leaving.prepare()
    from orchestrator.remote.admission import Exactly  # noqa: PLC0415 - the guard is small
    from orchestrator.remote.host import ComponentHost  # noqa: PLC0415

    faulthandler.enable()
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    lifeline = _take_standard_input()
    instructions = json.loads(_read_line(lifeline))
    threading.Thread(target=_end_with_parent, args=(lifeline,), daemon=True).start()
    logs = RecordCollector()
    logs.setFormatter(logging.Formatter("%(message)s"))
    logging.basicConfig(level=instructions["log_level"], handlers=[logs])
    channel = _connect(instructions)
    host = ComponentHost(logs.drain, channel.memory, Exactly(instructions["admits"]))
    try:
        while command := channel.receive():
            channel.send(host.handle(command))
        host.close()
    finally:
        channel.close()
    return leaving.ends_with(0)


def _connect(instructions: dict[str, Any]) -> "HostChannel":
    module, _, name = instructions["channel"].partition(":")
    channel: type[HostChannel] = getattr(importlib.import_module(module), name)
    return channel(**instructions["options"])


def _take_standard_input() -> int:
    """Move standard input out of the reach of components, which may want to read theirs."""
    lifeline = os.dup(0)
    nothing = os.open(os.devnull, os.O_RDONLY)
    os.dup2(nothing, 0)
    os.close(nothing)
    return lifeline


def _read_line(descriptor: int) -> bytes:
    # unbuffered: a thread inside a buffered reader would break the interpreter's shutdown
    line = b""
    while not line.endswith(b"\n"):
        piece = os.read(descriptor, 1)
        if not piece:
            sys.exit("the parent ended before it said how to connect")
        line += piece
    return line


def _end_with_parent(lifeline: int) -> None:
    while os.read(lifeline, 4096):
        pass
    if sys.platform != "win32" and os.getpgrp() == os.getpid():
        os.killpg(0, signal.SIGKILL)  # this process and whatever its component started
    os._exit(1)


if __name__ == "__main__":
    sys.exit(main())
