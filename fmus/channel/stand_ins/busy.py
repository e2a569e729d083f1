"""The channel busy ratio of radios that hear frames."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from orchestrator.signal import Array
from orchestrator.timebase import Duration, Time

Int = npt.NDArray[np.int64]
Float = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class _OnAir:
    """One frame, and everyone for whom the medium is busy with it."""

    vehicles: Int
    start: Time
    end: Time


@dataclass(frozen=True, slots=True)
class BusyState:
    """What `BusyRatio` knows."""

    frames: tuple[_OnAir, ...]
    window_ends: Time
    vehicles: Int
    ratios: Float


class BusyRatio:
    """The share of the last complete window in which at least one frame was on the air.

    Propagation is not counted: the medium is busy everywhere while the transmitter sends.
    """

    def __init__(self, window: Duration, start: Time) -> None:
        self._window = window
        self._window_ends = start + window
        self._frames: list[_OnAir] = []
        self._vehicles: Int = np.empty(0, np.int64)
        self._ratios: Float = np.empty(0)
        self._asked: Array | None = None
        self._answer: Float = np.empty(0)

    def add(self, vehicles: Int, start: Time, end: Time) -> None:
        """Take note of a frame.

        Args:
            vehicles: for whom the medium is busy with it: numbers, shape (vehicle,).
            start: when it goes on the air [ns].
            end: when it leaves it [ns].
        """
        self._frames.append(_OnAir(vehicles, start, end))

    def advance(self, now: Time) -> None:
        """Every frame that starts before `now` [ns] has been added."""
        if now < self._window_ends:
            return
        whole = (now - self._window_ends) // self._window
        end = self._window_ends + whole * self._window
        self._vehicles, busy = _union(self._frames, end - self._window, end)
        self._ratios = busy / self._window
        self._frames = [frame for frame in self._frames if frame.end > end]
        self._window_ends = end + self._window
        self._asked = None

    def of(self, vehicles: Array) -> Float:
        """The ratios of `vehicles`, 0 where nothing was heard; the same object if nothing changed.

        Args:
            vehicles: numbers of the vehicles, shape (vehicle,).

        Returns:
            Shares of the last complete window, 0 to 1, shape (vehicle,).
        """
        if self._asked is not vehicles:
            self._asked, self._answer = vehicles, np.zeros(len(vehicles))
            rows = np.searchsorted(self._vehicles, vehicles)
            known = rows < len(self._vehicles)
            known[known] = self._vehicles[rows[known]] == vehicles[known]
            self._answer[known] = self._ratios[rows[known]]
        return self._answer

    def save(self) -> BusyState:
        """The state, to be restored any number of times."""
        return BusyState(tuple(self._frames), self._window_ends, self._vehicles, self._ratios)

    def restore(self, state: BusyState) -> None:
        """Return to `state`."""
        self._frames = [*state.frames]
        self._window_ends = state.window_ends
        self._vehicles, self._ratios = state.vehicles, state.ratios
        self._asked = None


def _union(frames: list[_OnAir], start: Time, end: Time) -> tuple[Int, Int]:
    """Vehicles, ascending, and how long between `start` and `end` at least one frame busied each.

    Returns:
        Numbers of vehicles and durations [ns], shape (vehicle,) each.
    """
    here = [frame for frame in frames if frame.start < end and frame.end > start]
    if not here:
        return np.empty(0, np.int64), np.empty(0, np.int64)
    counts = [len(frame.vehicles) for frame in here]
    first = np.repeat([max(frame.start, start) - start for frame in here], counts)
    last = np.repeat([min(frame.end, end) - start for frame in here], counts)
    vehicles, rank = np.unique(np.concatenate([f.vehicles for f in here]), return_inverse=True)
    order = np.lexsort((first, rank))
    rank, first, last = rank[order], first[order], last[order]
    # Put the vehicles' windows one after another, so that one running maximum serves all: a frame
    # adds what lies beyond the latest end before it.
    ends = last + rank * (end - start)
    latest = np.maximum.accumulate(np.concatenate([[0], ends[:-1]])) - rank * (end - start)
    added = np.maximum(last - np.maximum(first, latest), 0)
    return vehicles, np.bincount(rank, weights=added).astype(np.int64)
