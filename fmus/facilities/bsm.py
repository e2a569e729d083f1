"""Basic safety messages: who sends one when, and what the ego knows from those it received.

Each equipped vehicle sends one message per period at a phase of its own (SAE J2945/1 sends
BSMs at 10 Hz; the phase is uniform because vehicles do not synchronise).
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np

from fmus.facilities.inputs import Vehicles
from fmus.facilities.link_power import Powers
from fmus.facilities.streams import Streams
from fmus.messages.pose_errors import PoseErrors
from fmus.messages.records import NO_VEHICLE
from fmus.physics.plane import turned
from orchestrator.signal import Array
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

_TOLD: Final = ("id", "position", "heading", "velocity", "size", "antenna_height")
"""The fields that are connectors as they are."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Bsm:
    """A message on the air.

    Attributes:
        state: of the sender, a `CONTENT` record.
        heard: the powers at which the sender receives its neighbours, as it announces them.
    """

    state: np.void
    heard: Powers


@dataclass(frozen=True, slots=True, kw_only=True)
class Bsms:
    """The messages that go on the air in one step.

    Attributes:
        states: those of the senders, `CONTENT` records, shape (message,).
        heard: what each sender measures; `power` is of shape (message, link).
    """

    states: Array
    heard: Powers

    def message(self, k: int) -> Bsm:
        """Message `k`."""
        heard = Powers(transmitter=self.heard.transmitter, power=self.heard.power[k])
        return Bsm(state=self.states[k], heard=heard.announced())


class BsmSender:
    """Decides at which times each vehicle sends, and writes the contents."""

    def __init__(self, period: Duration, streams: Streams) -> None:
        self._period = period
        self._streams = streams
        self._phases: dict[int, Duration] = {}
        self._known: tuple[Vehicles, PoseErrors] | None = None
        self._states: Array = np.empty(0, CONTENT)
        self._state_phases: Array = np.empty(0, np.int64)

    def due(
        self, vehicles: Vehicles, errors: PoseErrors, begin: Time, end: Time
    ) -> tuple[Array, Array]:
        """The messages sent in [`begin`, `end`).

        Args:
            vehicles: every vehicle on the scene.
            errors: by how much they are wrong: a message says what its sender believes.
            begin: of the interval [ns].
            end: of the interval, at most one period later [ns].

        Returns:
            The times of sending [ns], int64, shape (message,), and the contents, `CONTENT`
            records of the same shape, with the state at the communication point.
        """
        self._meet(vehicles, errors)
        times = begin + (self._state_phases - begin) % self._period
        sending = times < end
        contents = self._states.compress(sending)
        contents["time"] = times[sending]
        return times[sending], contents

    def _meet(self, vehicles: Vehicles, errors: PoseErrors) -> None:
        """Look up states and phases of the equipped vehicles, unless all is as before."""
        if self._known is not None:
            known, wrong = self._known
            if vehicles.is_same(known) and errors.is_same(wrong):
                return
        self._known = vehicles, errors
        equipped = np.flatnonzero(vehicles.equipped)
        self._states = np.zeros(len(equipped), CONTENT)
        self._states["id"] = vehicles.id[equipped]
        self._states["position"] = vehicles.position[equipped, :2]
        self._states["heading"] = vehicles.heading[equipped]
        self._states["velocity"] = vehicles.velocity[equipped]
        self._states["size"] = vehicles.size[equipped]
        self._states["antenna_height"] = vehicles.antenna_height[equipped]
        ids = self._states["id"].tolist()
        for state in self._states if len(errors.vehicle) else ():
            _make_wrong(state, errors)
        for vehicle in ids:
            if vehicle not in self._phases:
                self._phases[vehicle] = int(self._streams.of(vehicle).integers(self._period))
        self._state_phases = np.array([self._phases[vehicle] for vehicle in ids], np.int64)


def _make_wrong(state: np.void, errors: PoseErrors) -> None:
    """Let a `CONTENT` record say what its sender believes of its pose, and of its direction."""
    error = errors.of(int(state["id"]))
    if error is None:
        return
    shift, angle = error
    x, y = state["velocity"]
    state["position"] += shift
    state["heading"] += angle
    state["velocity"] = turned(x, y, angle)


class Neighbourhood:
    """The last message received from each neighbour, while it is fresh."""

    def __init__(self, maximum_age: Duration) -> None:
        self._maximum_age = maximum_age
        self._table: Array = np.empty(0, CONTENT)  # by ascending id
        self._row: dict[int, int] = {}
        self._changed = True
        self._values: Mapping[str, Array] = {}

    def receive(self, content: np.void) -> None:
        """Take in one `CONTENT` record; an older one than known changes nothing."""
        row = self._row.get(int(content["id"]))
        if row is None:
            self._set(np.array(sorted([*self._table, content], key=lambda c: c["id"]), CONTENT))
        elif self._table[row]["time"] < content["time"]:
            self._table[row] = content
            self._changed = True

    def outputs(self, now: Time, ego: int = NO_VEHICLE) -> Mapping[str, Array]:
        """The connectors `received.bsm.*` at `now`, neighbours by ascending id.

        What did not change is the same object as before.

        Returns:
            By name, arrays with the shape and unit that the connector declares.
        """
        keep = (self._table["time"] >= now - self._maximum_age) & (self._table["id"] != ego)
        if not keep.all():
            self._set(self._table.compress(keep))
        if self._changed:
            self._values = {f"received.bsm.{field}": self._table[field].copy() for field in _TOLD}
            self._changed = False
        return {**self._values, "received.bsm.age": (now - self._table["time"]) / 1e9}

    def _set(self, table: Array) -> None:
        self._table = table
        self._row = {vehicle: row for row, vehicle in enumerate(table["id"].tolist())}
        self._changed = True
