"""Basic safety messages: who sends one when, and what the ego knows from those it received.

Each equipped vehicle sends one message per period at a phase of its own (SAE J2945/1 sends
BSMs at 10 Hz; the phase is uniform because vehicles do not synchronise).
"""

from collections.abc import Mapping
from typing import Final

import numpy as np

from fmus.records import NO_VEHICLE
from orchestrator.signal import Array, Signals
from orchestrator.timebase import Duration, Time

CONTENT: Final = np.dtype(
    [
        ("id", "<i8"),
        ("time", "<i8"),
        ("position", "<f8", 2),
        ("heading", "<f8"),
        ("velocity", "<f8", 2),
        ("size", "<f8", 3),
        ("antenna_height", "<f8"),
    ]
)
"""What one message says; fields as the connectors `received.bsm.*`, `time` in [ns]."""


class BsmSender:
    """Decides at which times each vehicle sends, and writes the contents."""

    def __init__(self, period: Duration, rng: np.random.Generator) -> None:
        self._period = period
        self._rng = rng
        self._phases: dict[int, Duration] = {}

    def due(self, vehicles: Signals, begin: Time, end: Time) -> tuple[Array, Array]:
        """The messages sent in [`begin`, `end`).

        Args:
            vehicles: the inputs `vehicle.*` of the facilities layer.
            begin: of the interval [ns].
            end: of the interval, at most one period later [ns].

        Returns:
            The times of sending [ns], shape (messages,), and the contents, `CONTENT`
            records of the same shape, with the state at the communication point.
        """
        ids = vehicles["vehicle.id"]
        equipped = np.flatnonzero(vehicles["vehicle.equipped"])
        phases = np.array([self._phase(int(ids[i])) for i in equipped], dtype=np.int64)
        times = begin + (phases - begin) % self._period
        sending = times < end
        rows = equipped[sending]
        contents = np.empty(len(rows), CONTENT)
        contents["id"] = np.asarray(ids)[rows]
        contents["time"] = times[sending]
        contents["position"] = np.asarray(vehicles["vehicle.position"])[rows, :2]
        for field in ("heading", "velocity", "size", "antenna_height"):
            contents[field] = np.asarray(vehicles[f"vehicle.{field}"])[rows]
        return times[sending], contents

    def _phase(self, vehicle: int) -> Duration:
        if vehicle not in self._phases:
            self._phases[vehicle] = int(self._rng.integers(self._period))
        return self._phases[vehicle]


class Neighbourhood:
    """The last message received from each neighbour, while it is fresh."""

    def __init__(self, maximum_age: Duration) -> None:
        self._maximum_age = maximum_age
        self._last: dict[int, np.void] = {}

    def receive(self, content: np.void) -> None:
        """Take in one `CONTENT` record; an older one than known changes nothing."""
        vehicle = int(content["id"])
        known = self._last.get(vehicle)
        if known is None or known["time"] < content["time"]:
            self._last[vehicle] = content

    def outputs(self, now: Time, ego: int = NO_VEHICLE) -> Mapping[str, Array]:
        """The connectors `received.bsm.*` at `now`, neighbours by ascending id."""
        self._last = {
            vehicle: content
            for vehicle, content in self._last.items()
            if now - int(content["time"]) <= self._maximum_age and vehicle != ego
        }
        table = np.empty(len(self._last), CONTENT)
        for row, vehicle in enumerate(sorted(self._last)):
            table[row] = self._last[vehicle]
        values = {
            f"received.bsm.{field}": np.ascontiguousarray(table[field])
            for field in ("id", "position", "heading", "velocity", "size", "antenna_height")
        }
        values["received.bsm.age"] = (now - table["time"]) / 1e9
        return values
