"""What an FMU logs: to Python's logging, and into the text of the error that follows."""

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
    """The log of one instance, `nlosim.fmu.<instance>`.

    Attributes:
        recent: the last messages that are no mere information, oldest first.
    """

    def __init__(self, instance: str) -> None:
        self._logger = logging.getLogger(f"nlosim.fmu.{instance}")
        self.recent: deque[str] = deque(maxlen=5)

    @property
    def is_verbose(self) -> bool:
        """Whether anybody listens to the messages of an FMU that is doing well."""
        return self._logger.isEnabledFor(logging.DEBUG)

    def note(self, text: str) -> None:
        """Log a remark of the importer's own."""
        self._logger.info("%s", text)

    def receive(self, status: int, category: bytes | None, message: bytes | None) -> None:
        """Take one message; called by the FMU, so it must not raise."""
        known = status if 0 <= status < len(_LEVELS) else 3
        text = (message or b"").decode("utf-8", "replace")
        self._logger.log(_LEVELS[known], "%s: %s", (category or b"").decode(), text)
        if 0 < known < 5:
            self.recent.append(text)
