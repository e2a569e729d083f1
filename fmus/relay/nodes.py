"""The radios that the ego knows: itself, its neighbours, and where the sharer was last."""

from dataclasses import dataclass, replace

import numpy as np

from fmus.apm import read_header, split
from orchestrator.signal import Array, Signals


@dataclass(frozen=True, slots=True, kw_only=True)
class Node:
    """A radio as the ego knows it: position and velocity (2,) [m], [m/s], antenna [m]."""

    vehicle: int
    position: Array
    velocity: Array
    antenna_height: float

    def distance(self, other: "Node") -> float:
        """To `other` on the ground [m]."""
        return float(np.linalg.norm(other.position - self.position))


def neighbours(inputs: Signals) -> dict[int, Node]:
    """The neighbours by their BSMs, moved on by the age of the message; ascending ids."""
    position = np.asarray(inputs["received.bsm.position"])
    velocity = np.asarray(inputs["received.bsm.velocity"])
    age = np.asarray(inputs["received.bsm.age"])
    antenna = np.asarray(inputs["received.bsm.antenna_height"])
    return {
        int(vehicle): Node(
            vehicle=int(vehicle),
            position=position[row] + age[row] * velocity[row],
            velocity=velocity[row],
            antenna_height=float(antenna[row]),
        )
        for row, vehicle in enumerate(np.asarray(inputs["received.bsm.id"]))
    }


def ego_node(inputs: Signals) -> Node:
    """The ego, with the antenna at its roof."""
    heading = float(np.asarray(inputs["ego.heading"]))
    speed = float(np.asarray(inputs["ego.speed"]))
    return Node(
        vehicle=int(np.asarray(inputs["ego.id"])),
        position=np.asarray(inputs["ego.position"]),
        velocity=speed * np.array([np.cos(heading), np.sin(heading)]),
        antenna_height=float(np.asarray(inputs["ego.size"])[2]),
    )


class Whereabouts:
    """Where nodes were last heard.

    A sharer whose own BSMs are shadowed is still known: its APMs, which come over the
    relay, carry its position.
    """

    def __init__(self) -> None:
        self._last: dict[int, Node] = {}

    def update(self, inputs: Signals) -> None:
        """Take in the BSMs and APMs that the ego holds."""
        ego = int(np.asarray(inputs["ego.id"]))
        heard = neighbours(inputs)
        self._last |= heard
        for message in split(bytes(inputs["received.apms"])):
            header = read_header(message)
            vehicle = int(header["vehicle"])
            if vehicle != ego and vehicle in self._last and vehicle not in heard:
                self._last[vehicle] = replace(self._last[vehicle], position=header["position"])

    def of(self, vehicle: int) -> Node | None:
        """The last that is known of `vehicle`; None if it was never heard."""
        return self._last.get(vehicle)
