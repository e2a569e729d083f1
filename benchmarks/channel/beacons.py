"""Beacons: every vehicle sends ten packets a second."""

from dataclasses import dataclass
from typing import Final

import numpy as np

from fmus.messages.records import BSM, NO_VEHICLE, PACKET, frame
from orchestrator.timebase import NANOSECONDS_PER_SECOND, CommunicationGrid, nanoseconds

INTERVAL: Final = nanoseconds("0.1")
"""Time between two packets of a vehicle, and between two scenes [ns]."""

PACKET_SIZE: Final = 200
"""Size of a packet [byte]; Veins has 1600 bit."""

VOICE: Final = 3
"""The access category of user priority 7."""

SEED: Final = 1


@dataclass(frozen=True, slots=True, kw_only=True)
class Beacons:
    """Who sends when.

    Attributes:
        vehicles: how many of them send.
        jitter: each gap is the interval plus a uniform draw from -jitter to jitter [s].
    """

    vehicles: int
    jitter: float

    def packets(self, grid: CommunicationGrid) -> list[bytes]:
        """The Binary signal `packets` of each communication step.

        Phases are uniform over one interval, and nobody sends in the first one, as in the runs of
        Veins.
        """
        times, sources = self._times(grid)
        records = np.zeros(len(times), PACKET)
        records["id"] = np.arange(len(times))
        records["time"] = times
        records["source"] = sources
        records["destination"] = NO_VEHICLE
        records["route"] = NO_VEHICLE
        records["size"] = PACKET_SIZE
        records["access_category"] = VOICE
        records["kind"] = BSM
        ends = np.searchsorted(times, [grid.after(t) for t in grid])
        begins = [0, *ends[:-1]]
        return [frame("PKTS", records[a:b]) for a, b in zip(begins, ends, strict=True)]

    def _times(self, grid: CommunicationGrid) -> tuple[np.ndarray, np.ndarray]:
        """Times [ns], ascending, and the vehicle that sends at each."""
        stop = grid.stop
        rng = np.random.default_rng(SEED)
        count = (stop - grid.start) // INTERVAL + 1
        first = grid.start + INTERVAL * (1 + rng.random((self.vehicles, 1)))
        gaps = np.full((self.vehicles, count), float(INTERVAL))
        gaps += NANOSECONDS_PER_SECOND * self.jitter * rng.uniform(-1, 1, gaps.shape)
        times = np.floor(np.hstack([first, first + np.cumsum(gaps, axis=1)])).astype(np.int64)
        vehicle, number = np.nonzero(times < stop)
        found = times[vehicle, number]
        order = np.lexsort((vehicle, found))
        return found[order], vehicle[order]
