"""Where radios and bodies will be over the window: on along their velocities."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fmus.relay.crossings import Hops, antennas, vehicles
from fmus.relay.nodes import Node
from orchestrator.signal import Array


@dataclass(frozen=True, slots=True, kw_only=True)
class Horizon:
    """Instants from now on.

    Attributes:
        time: of each instant [s], ascending, (instant,).
    """

    time: Array

    @classmethod
    def over(cls, window: float, step: float) -> "Horizon":
        """Now, and then the instants of `within`."""
        return cls(time=np.concatenate([[0.0], cls.within(window, step).time]))

    @classmethod
    def within(cls, window: float, step: float) -> "Horizon":
        """The middles of equal parts of `window`, at most `step` long [s]."""
        count = max(1, int(np.ceil(window / step - 1e-9)))
        return cls(time=(np.arange(count) + 0.5) * (window / count))

    def hops(self, pairs: Sequence[tuple[Node, Node]], ego: Node, route: Array) -> Hops:
        """Hops between nodes at each instant, the ego on its route and all others straight on.

        Args:
            pairs: both ends of each hop.
            ego: where it is.
            route: as in `along`.

        Returns:
            Hops of shape (instant, hop).
        """
        driven = self.along(ego, route)
        ends = []
        for nodes in ([pair[0] for pair in pairs], [pair[1] for pair in pairs]):
            places = self.antennas(nodes)
            places[:, vehicles(nodes) == ego.vehicle, :2] = driven[:, None]
            ends.append(places)
        return Hops(vehicle=Hops.between(pairs).vehicle, start=ends[0], end=ends[1])

    def straight(self, position: Array, velocity: Array) -> Array:
        """Positions of what moves on at its velocity.

        Args:
            position: now [m], shape (n, 2) or (n, 3).
            velocity: of each [m/s], of the same shape.

        Returns:
            Positions [m], shape (instant, n, 2) or (instant, n, 3).
        """
        return np.asarray(position + self.time[:, None, None] * velocity)

    def antennas(self, nodes: Sequence[Node]) -> Array:
        """Places of the antennas at each instant: x, y and height [m], shape (instant, node, 3)."""
        velocity = np.array([(*node.velocity, 0.0) for node in nodes]).reshape(-1, 3)
        return self.straight(antennas(nodes), velocity)

    def along(self, node: Node, route: Array) -> Array:
        """Positions of who keeps its speed along a route.

        Args:
            node: where it is.
            route: centre line from there on [m], shape (corner, 2); fewer than two corners:
                straight on. Beyond the last corner it goes straight on.

        Returns:
            Positions [m], shape (instant, 2).
        """
        step = np.diff(route, axis=0)
        length = np.hypot(step[:, 0], step[:, 1])
        step, length = step[length > 0.0], length[length > 0.0]
        if len(length) == 0:
            return self.straight(node.position[None], node.velocity[None])[:, 0]
        station = np.concatenate([[0.0], np.cumsum(length)])
        travelled = float(np.hypot(*node.velocity)) * self.time
        edge = np.clip(np.searchsorted(station, travelled, side="right") - 1, 0, len(length) - 1)
        corner = node.position + np.concatenate([np.zeros((1, 2)), np.cumsum(step, axis=0)])
        rest = (travelled - station[edge]) / length[edge]
        return np.asarray(corner[edge] + rest[:, None] * step[edge])
