"""What an FMU logs: to Python's logging, and into the text of the error that follows."""

import ctypes
import logging
from collections import deque
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Final

_LEVELS: Final = (
    logging.DEBUG,  # OK
    logging.WARNING,  # Warning
    logging.WARNING,  # Discard
    logging.ERROR,  # Error
    logging.CRITICAL,  # Fatal
    logging.DEBUG,  # Pending (FMI 2.0)
)
STATUS_NAMES: Final = ("OK", "Warning", "Discard", "Error", "Fatal", "Pending")

_ALL: Final = "nlosim.fmu"
"""The logger above those of all instances."""

ASK: Final = ", as it was not asked to; `fmi.logging: true` (`nlosim fmu run --logging`) asks it"
"""What the error of an FMU adds that says nothing, where it could be asked to."""


class MessageLog:
    """The log of one instance, `nlosim.fmu.<instance>`.

    Args:
        instance: its name.
        is_asked: whether the FMU is asked to log all it can, by whoever runs it.
    """

    def __init__(self, instance: str, *, is_asked: bool = False) -> None:
        self._logger = logging.getLogger(f"{_ALL}.{instance}")
        self._is_asked = is_asked
        self._recent: deque[str] = deque(maxlen=5)
        self._calls: ctypes.c_uint64 | None = None
        self._call = 0

    @property
    def recent(self) -> deque[str]:
        """The last messages that are no mere information, oldest first, since it was cleared.

        Where compiled code counts calls, those of the last call.
        """
        if self._calls is not None and self._calls.value != self._call:
            self._call = self._calls.value
            self._recent.clear()
        return self._recent

    def count_calls(self, address: int | None) -> None:
        """Tell messages of different calls apart by the number (uint64) at `address`."""
        self._calls = None if address is None else ctypes.c_uint64.from_address(address)

    @property
    def is_verbose(self) -> bool:
        """Whether anybody listens to the messages of an FMU that is doing well."""
        return self._is_asked or self._logger.isEnabledFor(logging.DEBUG)

    @property
    def reason(self) -> str:
        """Why a call failed, as far as the FMU has said so."""
        if self.recent:
            return "; ".join(self.recent)
        return "the FMU logged no reason" + ("" if self.is_verbose else ASK)

    def note(self, text: str) -> None:
        """Log a remark of the importer's own."""
        self._logger.info("%s", text)

    def warn(self, text: str) -> None:
        """Log a warning of the importer's own."""
        self._logger.warning("%s", text)

    def receive(self, status: int, category: bytes | None, message: bytes | None) -> None:
        """Take one message; called by the FMU, so it must not raise."""
        known = status if 0 <= status < len(_LEVELS) else 3
        text = (message or b"").decode("utf-8", "replace")
        level = max(_LEVELS[known], logging.INFO) if self._is_asked else _LEVELS[known]
        topic = (category or b"").decode("utf-8", "replace")
        self._logger.log(level, "%s%s", f"{topic}: " if topic else "", text)
        if 0 < known < 5:
            self.recent.append(text)


@contextmanager
def shown(*, verbose: bool) -> Iterator[None]:
    """Write to standard error what FMUs log, where there is no log.txt for it.

    Args:
        verbose: all that they say, not warnings and errors alone.
    """
    logger, terminal = logging.getLogger(_ALL), logging.StreamHandler()
    before = logger.level, logger.propagate
    terminal.setFormatter(logging.Formatter("%(message)s"))
    logger.addHandler(terminal)
    logger.setLevel(logging.INFO if verbose else logging.WARNING)
    logger.propagate = False
    try:
        yield
    finally:
        logger.removeHandler(terminal)
        logger.setLevel(before[0])
        logger.propagate = before[1]
