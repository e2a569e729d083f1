"""What an FMU logs: to Python's logging, and into the text of the error that follows."""

import ctypes
import logging
from collections import deque
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


class MessageLog:
    """The log of one instance, `nlosim.fmu.<instance>`."""

    def __init__(self, instance: str) -> None:
        self._logger = logging.getLogger(f"nlosim.fmu.{instance}")
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
        return self._logger.isEnabledFor(logging.DEBUG)

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
        self._logger.log(_LEVELS[known], "%s: %s", (category or b"").decode(), text)
        if 0 < known < 5:
            self.recent.append(text)
