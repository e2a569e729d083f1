"""The log of a run: what was logged and warned about, in a file of the run directory."""

import logging
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Final

from typing_extensions import override

from orchestrator.wording import Openly, Wording

LOG: Final = "log.txt"

_UNHEARD: Final = ("matplotlib", "fontTools")
"""Loggers of libraries whose warnings are for us, such as of a cache: in the file alone."""


class _Formatter(logging.Formatter):
    """Time of day in UTC with milliseconds, level, logger, message."""

    default_msec_format = "%s.%03dZ"

    def __init__(self, wording: Wording) -> None:
        super().__init__("%(asctime)s %(levelname)-7s %(name)s: %(message)s")
        self.converter = time.gmtime
        self._wording = wording

    @override
    def format(self, record: logging.LogRecord) -> str:
        return self._wording.text(super().format(record))


class _Brief(logging.Formatter):
    """One line per record, without a traceback; that is in the file."""

    @override
    def format(self, record: logging.LogRecord) -> str:
        return f"{record.levelname.lower()}: {record.getMessage()}"


class _File(logging.FileHandler):
    """A disk that is full is reported by whoever needs it; the log then ends early."""

    @override
    def handleError(self, record: logging.LogRecord) -> None:
        pass


@contextmanager
def run_log(directory: Path, *, echo: bool, wording: Wording | None = None) -> Iterator[None]:
    """Write what is logged to `directory`/log.txt, and Python's warnings, too.

    Args:
        directory: the run directory; it exists.
        echo: whether warnings and errors appear on standard error as well.
        wording: how it is written down; `None`: as it is.
    """
    file = _File(directory / LOG, encoding="utf-8")
    file.setFormatter(_Formatter(wording or Openly()))
    handlers: list[logging.Handler] = [file]
    if echo:
        terminal = logging.StreamHandler()
        terminal.setLevel(logging.WARNING)
        terminal.setFormatter(_Brief())
        terminal.addFilter(lambda record: record.name.partition(".")[0] not in _UNHEARD)
        handlers.append(terminal)
    root = logging.getLogger()
    level = root.level
    root.setLevel(logging.INFO)
    for handler in handlers:
        root.addHandler(handler)
    logging.captureWarnings(capture=True)
    try:
        yield
    finally:
        logging.captureWarnings(capture=False)
        root.setLevel(level)
        for handler in handlers:
            root.removeHandler(handler)
            with suppress(OSError):
                handler.close()
