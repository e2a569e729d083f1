"""The radios that the ego knows: itself, and its neighbours by their BSMs."""

from dataclasses import dataclass, field
from typing import Self

import numpy as np

from fmus.messages.connectors import arrays_beneath
from orchestrator.signal import Array, Signals


@dataclass(frozen=True, slots=True, kw_only=True)
class Node:
    """A radio as the ego knows it.

    Attributes:
        vehicle: number of the vehicle, or of the roadside unit, that carries it.
        position: centre of the body, above which the antenna stands [m], shape (2,).
        velocity: of the body [m/s], shape (2,); zero at a roadside unit.
        antenna_height: above the ground [m].
        heading: of the body, counter-clockwise from east [rad].
        size: length, width and height of the body [m], shape (3,); zero if nothing is known.
    """

    vehicle: int
    position: Array
    velocity: Array
    antenna_height: float
    heading: float = 0.0
    size: Array = field(default_factory=lambda: np.zeros(3))

    def distance(self, other: "Node") -> float:
        """The distance to `other` on the ground [m]."""
        return float(np.linalg.norm(other.position - self.position))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Bsms:
    """The newest BSM of every neighbour, as its sender wrote it: the signals `received.bsm.*`.

    Attributes:
        vehicle: numbers of the senders, ascending, int64, shape (neighbour,).
        position: centres of their bodies when they sent [m], shape (neighbour, 2).
        velocity: of the bodies [m/s], shape (neighbour, 2).
        antenna_height: above the ground [m], shape (neighbour,).
        heading: of the bodies, counter-clockwise from east [rad], shape (neighbour,).
        size: length, width and height of the bodies [m], shape (neighbour, 3).
        age: time since they sent [s], shape (neighbour,).
    """

    vehicle: Array
    position: Array
    velocity: Array
    antenna_height: Array
    heading: Array
    size: Array
    age: Array

    @classmethod
    def read(cls, signals: Signals) -> Self:
        """The BSMs in the inputs of a relay policy."""
        found = arrays_beneath(signals, "received.bsm")
        return cls(vehicle=found.pop("id"), **found)

    def node(self, row: int, later: float = 0.0) -> Node:
        """One of the senders, moved on at the velocity that it told.

        Args:
            row: of the sender.
            later: time since these BSMs were read [s].
        """
        elapsed = float(self.age[row]) + later
        return Node(
            vehicle=int(self.vehicle[row]),
            position=self.position[row] + elapsed * self.velocity[row],
            velocity=self.velocity[row],
            antenna_height=float(self.antenna_height[row]),
            heading=float(self.heading[row]),
            size=self.size[row],
        )

    def heard_within(self, age: float) -> dict[int, Node]:
        """The senders whose BSM is at most `age` [s] old, moved on to now, by ascending number."""
        rows = np.flatnonzero(self.age <= age).tolist()
        return {int(self.vehicle[row]): self.node(row) for row in rows}


def read_ego(signals: Signals) -> Node:
    """The ego, with its antenna at its roof, from the inputs of a relay policy."""
    heading = float(np.asarray(signals["ego.heading"], np.float64))
    speed = float(np.asarray(signals["ego.speed"], np.float64))
    size = np.asarray(signals["ego.size"], np.float64)
    return Node(
        vehicle=int(np.asarray(signals["ego.id"], np.int64)),
        position=np.asarray(signals["ego.position"], np.float64),
        velocity=speed * np.array([np.cos(heading), np.sin(heading)]),
        antenna_height=float(size[2]),
        heading=heading,
        size=size,
    )
