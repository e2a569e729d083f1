"""Something to be done now and then."""

import time


class Throttle:
    """Says when it is time again.

    Args:
        seconds: between two times [s].
    """

    def __init__(self, seconds: float) -> None:
        self._seconds = seconds
        self._next = time.monotonic() + seconds

    def is_due(self) -> bool:
        """Whether it is time; then not for a while."""
        now = time.monotonic()
        if now < self._next:
            return False
        self._next = now + self._seconds
        return True
