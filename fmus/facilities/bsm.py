"""Basic safety messages: who sends one when, and what the ego knows from those it received.

Each equipped vehicle sends one message per period at a phase of its own (SAE J2945/1 sends
BSMs at 10 Hz; the phase is uniform because vehicles do not synchronise).
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np

from fmus.facilities.link_power import Powers
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


@dataclass(frozen=True, slots=True, kw_only=True)
class Bsm:
    """A message on the air.

    Attributes:
        state: of the sender, a `CONTENT` record.
        heard: the powers at which the sender receives its neighbours, as it announces them.
    """

    state: np.void
    heard: Powers


class BsmSender:
    """Decides at which times each vehicle sends, and writes the contents."""

    def __init__(self, period: Duration, rng: np.random.Generator) -> None:
        self._period = period
        self._rng = rng
        self._phases: dict[int, Duration] = {}
        self._known: tuple[object, object] = (None, None)
        self._rows: Array = np.empty(0, np.intp)
        self._row_phases: Array = np.empty(0, np.int64)

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
        self._meet(vehicles)
        times = begin + (self._row_phases - begin) % self._period
        sending = times < end
        rows = self._rows[sending]
        contents = np.empty(len(rows), CONTENT)
        contents["id"] = np.asarray(vehicles["vehicle.id"])[rows]
        contents["time"] = times[sending]
        contents["position"] = np.asarray(vehicles["vehicle.position"])[rows, :2]
        for field in ("heading", "velocity", "size", "antenna_height"):
            contents[field] = np.asarray(vehicles[f"vehicle.{field}"])[rows]
        return times[sending], contents

    def _meet(self, vehicles: Signals) -> None:
        """Look up the phases of the equipped vehicles, unless they are the same as before."""
        known = (vehicles["vehicle.id"], vehicles["vehicle.equipped"])
        if self._known[0] is known[0] and self._known[1] is known[1]:
            return
        self._known = known
        self._rows = np.flatnonzero(known[1])
        ids = np.asarray(known[0])[self._rows].tolist()
        for vehicle in ids:
            if vehicle not in self._phases:
                self._phases[vehicle] = int(self._rng.integers(self._period))
        self._row_phases = np.array([self._phases[vehicle] for vehicle in ids], np.int64)


class Neighbourhood:
    """The last message received from each neighbour, while it is fresh."""

    def __init__(self, maximum_age: Duration) -> None:
        self._maximum_age = maximum_age
        self._last: dict[int, np.void] = {}
        self._changed = True
        self._times: Array = np.empty(0, np.int64)
        self._values: Mapping[str, Array] = {}

    def receive(self, content: np.void) -> None:
        """Take in one `CONTENT` record; an older one than known changes nothing."""
        vehicle = int(content["id"])
        known = self._last.get(vehicle)
        if known is None or known["time"] < content["time"]:
            self._last[vehicle] = content
            self._changed = True

    def outputs(self, now: Time, ego: int = NO_VEHICLE) -> Mapping[str, Array]:
        """The connectors `received.bsm.*` at `now`, neighbours by ascending id.

        What did not change is the same object as before.
        """
        oldest = now - self._maximum_age
        if self._changed or (self._times < oldest).any() or ego in self._last:
            self._rebuild(oldest, ego)
        return {**self._values, "received.bsm.age": (now - self._times) / 1e9}

    def _rebuild(self, oldest: Time, ego: int) -> None:
        self._last = {
            vehicle: content
            for vehicle, content in self._last.items()
            if content["time"] >= oldest and vehicle != ego
        }
        table = np.empty(len(self._last), CONTENT)
        for row, vehicle in enumerate(sorted(self._last)):
            table[row] = self._last[vehicle]
        self._changed = False
        self._times = table["time"].copy()
        self._values = {
            f"received.bsm.{field}": np.ascontiguousarray(table[field])
            for field in ("id", "position", "heading", "velocity", "size", "antenna_height")
        }
