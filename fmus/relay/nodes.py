"""The radios that the ego knows: itself, its neighbours, and where the sharer was last."""

from dataclasses import dataclass, field, replace
from itertools import count, repeat

import numpy as np

from fmus.messages.apm import read_header, split
from orchestrator.signal import Array, Signals
from orchestrator.timebase import Time, seconds


@dataclass(frozen=True, slots=True, kw_only=True)
class Node:
    """A radio as the ego knows it.

    Attributes:
        vehicle: its number; of a roadside unit too.
        position: of its body's centre, above which the antenna stands [m], (2,).
        velocity: [m/s], (2,); zero at a roadside unit.
        antenna_height: above the ground [m].
        heading: of its body, counter-clockwise from east [rad].
        size: length, width and height of its body [m], (3,); zero if nothing is known.
    """

    vehicle: int
    position: Array
    velocity: Array
    antenna_height: float
    heading: float = 0.0
    size: Array = field(default_factory=lambda: np.zeros(3))

    def distance(self, other: "Node") -> float:
        """To `other` on the ground [m]."""
        return float(np.linalg.norm(other.position - self.position))


@dataclass(frozen=True, slots=True)
class _Heard:
    """The connectors `received.bsm.*` at one communication point."""

    time: Time
    vehicle: Array
    position: Array
    velocity: Array
    antenna_height: Array
    heading: Array
    size: Array
    age: Array

    def node(self, row: int, now: Time) -> Node:
        """One of the senders, moved on to `now` at the velocity that it told."""
        elapsed = float(self.age[row]) + seconds(now - self.time)
        return Node(
            vehicle=int(self.vehicle[row]),
            position=self.position[row] + elapsed * self.velocity[row],
            velocity=self.velocity[row],
            antenna_height=float(self.antenna_height[row]),
            heading=float(self.heading[row]),
            size=self.size[row],
        )


def _heard(inputs: Signals, now: Time) -> _Heard:
    fields = ("id", "position", "velocity", "antenna_height", "heading", "size", "age")
    return _Heard(now, *(np.asarray(inputs[f"received.bsm.{name}"]) for name in fields))


def neighbours(inputs: Signals, lost_after: float) -> dict[int, Node]:
    """Who was heard lately, by BSMs moved on by their age; ascending ids.

    Args:
        inputs: of the relay component.
        lost_after: who has not been heard for longer is left out [s].
    """
    heard = _heard(inputs, 0)
    rows = np.flatnonzero(heard.age <= lost_after).tolist()
    return {int(heard.vehicle[row]): heard.node(row, 0) for row in rows}


def ego_node(inputs: Signals) -> Node:
    """The ego, with the antenna at its roof."""
    heading = float(np.asarray(inputs["ego.heading"]))
    speed = float(np.asarray(inputs["ego.speed"]))
    size = np.asarray(inputs["ego.size"])
    return Node(
        vehicle=int(np.asarray(inputs["ego.id"])),
        position=np.asarray(inputs["ego.position"]),
        velocity=speed * np.array([np.cos(heading), np.sin(heading)]),
        antenna_height=float(size[2]),
        heading=heading,
        size=size,
    )


class Whereabouts:
    """Where nodes were last heard.

    A sharer whose own BSMs are shadowed is still known: its APMs, which come over the
    relay, carry its position.
    """

    def __init__(self) -> None:
        self._last: dict[int, tuple[_Heard, int]] = {}
        self._apms: object = None
        self._told: dict[int, tuple[Time, Array]] = {}

    def update(self, inputs: Signals, now: Time) -> None:
        """Take in the BSMs and APMs that the ego holds at `now` [ns]."""
        heard = _heard(inputs, now)
        self._last.update(zip(heard.vehicle.tolist(), zip(repeat(heard), count()), strict=False))
        apms = inputs["received.apms"]
        if apms is not self._apms:
            self._apms = apms
            for header in map(read_header, split(bytes(apms))):
                self._told[int(header["vehicle"])] = (int(header["time"]), header["position"])

    def of(self, vehicle: int, now: Time) -> Node | None:
        """The last that is known of `vehicle`, moved on to `now`; None if no BSM ever came.

        The position is that of the newer message, BSM or APM.
        """
        if vehicle not in self._last:
            return None
        heard, row = self._last[vehicle]
        node = heard.node(row, now)
        if vehicle not in self._told:
            return node
        time, position = self._told[vehicle]
        if time <= heard.time - round(float(heard.age[row]) * 1e9):
            return node
        return replace(node, position=position + seconds(now - time) * node.velocity)
