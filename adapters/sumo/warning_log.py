"""SUMO's warnings in the log of the run: its own output is silent, and demand can get lost so."""

import logging
import re
from collections import Counter
from pathlib import Path
from typing import Final, TextIO

from adapters.sumo.checks.configuration import read_configuration
from orchestrator.scratch import discard, temporary_folder

logger = logging.getLogger(__name__)

_FIRST: Final = 20
"""Warnings of one kind that are logged; of the others there is the number."""

_MOST_KINDS: Final = 40
"""Kinds that are told apart: the log of a component in another process keeps 1000 records."""

_OTHERS: Final = "others"
_CHUNK: Final = 2**20
_VARIABLE: Final = re.compile(r"'[^']*'|\d[\d.:]*")
"""What differs between warnings of one kind: names and numbers."""

_ERROR: Final = "Error:"
_WARNING: Final = "Warning: "
_NAME: Final = "warnings.log"


class WarningLog:
    """Has SUMO write its warnings to a temporary file, and passes them on to the log.

    The first warning of a kind is logged as one, the next as information, and the number of
    each kind at the end. SUMO writes the file in blocks of some kilobytes, the rest when it ends.

    Args:
        config: the configuration that SUMO loads. Where it sets `error-log` or `no-warnings`
            itself, that stays so, and nothing is passed on.

    Attributes:
        options: that SUMO has to be started with.
    """

    def __init__(self, config: Path) -> None:
        self.options: tuple[str, ...] = ()
        self._scene = config.name
        self._folder: Path | None = None
        self._file: TextIO | None = None
        self._rest = ""
        self._counts: Counter[str] = Counter()
        self._examples: dict[str, str] = {}
        if own := _own_choice(config):
            logger.info("SUMO's warnings are not in this log: %s has %s", config.name, own)
            return
        self._folder = temporary_folder("warnings")
        self.options = ("--error-log", str(self._folder / _NAME))

    def read(self) -> None:
        """Pass on what SUMO has written since the last call."""
        if self._file is None:
            self._file = self._open()
        while self._file is not None and (text := self._file.read(_CHUNK)):
            *lines, self._rest = (self._rest + text).split("\n")
            for line in lines:
                self._take(line.strip())

    def close(self) -> None:
        """Pass on the rest, after SUMO has ended. Calling it twice is harmless."""
        if self._folder is None:
            return
        self.read()
        if self._file is not None:
            self._file.close()
        discard(self._folder)
        self._folder = self._file = None
        for kind, count in self._counts.items():
            if count > 1:
                example = self._examples[kind]
                logger.warning("SUMO (%s): %d in all like: %s", self._scene, count, example)

    def _open(self) -> TextIO | None:
        """SUMO's file, once it is there; an `output-prefix` comes before its name."""
        if self._folder is None:
            return None
        for path in self._folder.glob(f"*{_NAME}"):
            return path.open(encoding="utf-8", errors="replace")
        return None

    def _take(self, line: str) -> None:
        if not line or line.startswith(_ERROR):  # errors are on standard error, and raised
            return
        line = line.removeprefix(_WARNING)
        kind = _VARIABLE.sub("", line)
        if kind not in self._counts and len(self._counts) >= _MOST_KINDS:
            kind = _OTHERS
        self._counts[kind] += 1
        self._examples.setdefault(kind, line)
        if self._counts[kind] <= _FIRST:
            level = logging.WARNING if self._counts[kind] == 1 else logging.INFO
            logger.log(level, "SUMO (%s): %s", self._scene, line)


def _own_choice(config: Path) -> str:
    """What a configuration sets that decides where warnings go; empty if nothing does."""
    settings, _ = read_configuration(config)
    if "error-log" in settings:
        return f"`error-log`, {settings['error-log'].value}"
    if "no-warnings" in settings and settings["no-warnings"].is_on:
        return "`no-warnings`"
    if "output-prefix" in settings and Path(settings["output-prefix"].value).name != (
        settings["output-prefix"].value
    ):
        return "an `output-prefix` with a folder"
    return ""
