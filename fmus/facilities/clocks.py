"""The clocks of vehicles, and how far they are off."""

from typing import Final

import numpy as np

from orchestrator.randomness import substream
from orchestrator.timebase import NANOSECONDS_PER_SECOND, Duration

_PART: Final = "clocks"


class Clocks:
    """A constant error of each vehicle's clock, drawn from a normal distribution of mean 0.

    Oscillators drift by some microseconds per second between two fixes of satellite navigation, so
    that within a run the error is what it was at its beginning. It depends on the seed and on the
    number of the vehicle only: other traffic, and other draws of the component, leave it as it is.

    Args:
        stream: the component's; nothing is drawn from it.
        error: standard deviation of the errors [s]; 0: all clocks are right.
    """

    def __init__(self, stream: np.random.Generator, error: float) -> None:
        self._stream = stream
        self._error = error
        self._offsets: dict[int, Duration] = {}

    def offset(self, vehicle: int) -> Duration:
        """How far the clock of `vehicle` is ahead of the true time [ns]."""
        if not self._error:
            return 0
        if vehicle not in self._offsets:
            own = substream(self._stream, f"{_PART}-{vehicle}")
            off = self._error * own.standard_normal()
            self._offsets[vehicle] = round(off * NANOSECONDS_PER_SECOND)
        return self._offsets[vehicle]

    def lead(self, source: int, receiver: int) -> Duration:
        """How far the clock of `source` is ahead of that of `receiver` [ns].

        A time in a message of `source` seems to `receiver` to be so much later than it was.
        """
        return self.offset(source) - self.offset(receiver)
