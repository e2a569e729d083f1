"""How long to wait, counted in slices.

A slice that took much longer than it should is one in which this process did not run either
(Ctrl-Z, a suspended machine, one with so many processes that this one has to wait): of it only a
slice counts, because whoever is waited for had no more than that, for all we know.
"""

from time import monotonic
from typing import Final

SLICE: Final = 0.05
"""How long to wait before something else is looked at [s]."""

LONGEST_SLICE: Final = 0.1
"""What of a slice counts at most [s]; whoever could not go on for longer was stopped, or had no
processor, and so had the others."""


class Patience:
    """A time to wait, which a pause of this process does not take.

    Args:
        allowed: how long to wait [s].
    """

    def __init__(self, allowed: float) -> None:
        self._left = allowed

    @property
    def is_over(self) -> bool:
        """Whether it was waited for as long as is allowed."""
        return self._left <= 0.0

    def slice(self, most: float = SLICE) -> float:
        """How long to wait before the time is looked at again, up to `most` [s]."""
        return min(most, max(0.0, self._left))

    def spend(self, since: float) -> None:
        """Count the time since `since`, on the clock of `time.monotonic` [s]."""
        self._left -= min(monotonic() - since, LONGEST_SLICE)
