"""Finds the rows of a recording by link and time."""

from bisect import bisect_left, bisect_right
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from typing import Final

import numpy as np
import numpy.typing as npt

from orchestrator.timebase import Duration, Time

Int = npt.NDArray[np.int64]

NO_ROW: Final = -1
"""Instead of a row where a recording says nothing."""

_NOTHING: Final[Mapping[int, tuple[int, int]]] = {}


class LinkRows:
    """Rows sorted by transmitter, then receiver, then time.

    Args:
        times: [ns], shape (row,).
        transmitter: numbers of vehicles, shape (row,).
        receiver: numbers of vehicles, shape (row,).
    """

    def __init__(self, times: Int, transmitter: Int, receiver: Int) -> None:
        self._times: list[int] = times.tolist()
        is_new = (np.diff(transmitter, prepend=-1) != 0) | (np.diff(receiver, prepend=-1) != 0)
        first = np.flatnonzero(is_new)
        last = np.append(first, len(times))[1:]
        self._spans: dict[int, dict[int, tuple[int, int]]] = defaultdict(dict)
        links = (transmitter[first], receiver[first], first, last)
        for sender, hearer, begin, end in zip(*(part.tolist() for part in links), strict=True):
            self._spans[sender][hearer] = begin, end

    def __len__(self) -> int:
        return len(self._times)

    def at(self, time: Time, transmitter: int, receivers: Int) -> Int:
        """The last row of each link at or before `time` [ns].

        Args:
            time: [ns].
            transmitter: number of a vehicle.
            receivers: numbers of vehicles, shape (receiver,).

        Returns:
            Rows, `NO_ROW` where there is none, shape (receiver,).
        """
        found = np.full(len(receivers), NO_ROW)
        for index, first, last in self._recorded(transmitter, receivers):
            row = bisect_right(self._times, time, first, last) - 1
            found[index] = row if row >= first else NO_ROW
        return found

    def nearest(
        self, time: Time, transmitter: int, receivers: Int, tolerance: Duration, used: Sequence[int]
    ) -> Int:
        """The row of each link that is nearest to `time`, of equally near ones the first.

        Args:
            time: [ns].
            transmitter: number of a vehicle.
            receivers: numbers of vehicles, shape (receiver,).
            tolerance: rows farther away do not count [ns].
            used: by row, whether it does not count any more.

        Returns:
            Rows, `NO_ROW` where there is none, shape (receiver,).
        """
        found = np.full(len(receivers), NO_ROW)
        for index, first, last in self._recorded(transmitter, receivers):
            found[index] = self._nearest(time, first, last, tolerance, used)
        return found

    def _recorded(self, transmitter: int, receivers: Int) -> Iterator[tuple[int, int, int]]:
        """The index of each receiver that the recording knows, and where its rows begin and end."""
        spans = self._spans.get(transmitter, _NOTHING)
        for index, receiver in enumerate(receivers.tolist()):
            if (span := spans.get(receiver)) is not None:
                yield index, *span

    def _nearest(
        self, time: Time, first: int, last: int, tolerance: Duration, used: Sequence[int]
    ) -> int:
        """The nearest row from `first` to before `last`."""
        times = self._times
        later = bisect_left(times, time, first, last)
        earlier = later - 1
        while later < last and used[later] and times[later] - time <= tolerance:
            later += 1
        while earlier >= first and used[earlier] and time - times[earlier] <= tolerance:
            earlier -= 1
        ahead = times[later] - time if later < last else tolerance + 1
        behind = time - times[earlier] if earlier >= first else tolerance + 1
        if min(ahead, behind) > tolerance:
            return NO_ROW
        if ahead < behind:
            return later
        # several frames of one time were recorded in the order in which they were sent
        while earlier > first and not used[earlier - 1] and times[earlier - 1] == times[earlier]:
            earlier -= 1
        return earlier
