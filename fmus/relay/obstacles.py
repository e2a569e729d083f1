"""What the ego knows to stand between radios: the merged mobility-and-height information.

Three sources, in order of trust: BSMs (the sender's own size and motion), the ego's lidar
objects, and the mobility-and-height layers of received APMs. A body known from one source
is not added again from the next.
"""

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Final

import numpy as np

from fmus.messages.apm import Apm, layer_height, layer_velocity
from fmus.messages.columns import rows_of, stacked
from fmus.messages.records import NO_VEHICLE
from fmus.physics.boxes import in_boxes
from fmus.relay.nodes import Bsms, Node
from orchestrator.signal import Array

HEIGHT_TOLERANCE: Final = 0.3
"""An observed height may exceed the true one by this [m]: noise, and the layer's steps."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Obstacles:
    """Oriented boxes on the ground that move.

    Attributes:
        owner: the vehicle, where its BSM says so, else `NO_VEHICLE`; int64 (obstacle,).
        center: [m], (obstacle, 2).
        heading: of the length axis, counter-clockwise from east [rad], (obstacle,).
        half: half length and half width [m], (obstacle, 2).
        height: [m], (obstacle,).
        velocity: [m/s], (obstacle, 2).
    """

    owner: Array = field(default_factory=lambda: np.empty(0, np.int64))
    center: Array = field(default_factory=lambda: np.empty((0, 2)))
    heading: Array = field(default_factory=lambda: np.empty(0))
    half: Array = field(default_factory=lambda: np.empty((0, 2)))
    height: Array = field(default_factory=lambda: np.empty(0))
    velocity: Array = field(default_factory=lambda: np.empty((0, 2)))

    def explain(self, others: "Obstacles", margin: float) -> Array:
        """Whether each of `others` is one of these bodies, seen by somebody else.

        It is if its centre lies in a box grown by `margin` [m] that is not lower than it.

        Returns:
            bool, shape (other,).
        """
        local = np.abs(in_boxes(others.center[:, None, :], self.center, self.heading))
        inside: Array = np.all(local <= self.half + margin, axis=-1)
        high_enough = self.height + HEIGHT_TOLERANCE >= others.height[:, None]
        return np.asarray((inside & high_enough).any(axis=1))

    def joined(self, other: "Obstacles") -> "Obstacles":
        """These obstacles followed by `other`."""
        return stacked(self, other)

    def without(self, keep: Array) -> "Obstacles":
        """Only the obstacles where `keep` is true, bool, shape (obstacle,)."""
        return rows_of(self, keep)


def from_bsms(bsms: Bsms) -> Obstacles:
    """The senders of received BSMs, moved on by the age of the message."""
    return Obstacles(
        owner=bsms.vehicle,
        center=bsms.position + bsms.age[:, None] * bsms.velocity,
        heading=bsms.heading,
        half=bsms.size[:, :2] / 2.0,
        height=bsms.size[:, 2],
        velocity=bsms.velocity,
    )


def from_node(node: Node) -> Obstacles:
    """The body of a radio, where the ego knows it to be."""
    return Obstacles(
        owner=np.array([node.vehicle]),
        center=np.asarray(node.position)[None],
        heading=np.array([node.heading]),
        half=node.size[None, :2] / 2.0,
        height=node.size[2:],
        velocity=np.asarray(node.velocity)[None],
    )


def from_objects(objects: Array) -> Obstacles:
    """The ego's own detections.

    Args:
        objects: `OBJECT` records of the ego's sensor, shape (object,).
    """
    count = len(objects)
    return Obstacles(
        owner=np.full(count, NO_VEHICLE, np.int64),
        center=objects["position"].copy(),
        heading=objects["angle"].copy(),
        half=objects["size"] / 2.0,
        height=objects["height"].copy(),
        velocity=objects["velocity"].copy(),
    )


def from_layer(apm: Apm) -> Obstacles:
    """The occupied cells of the mobility-and-height layer of a received APM.

    A cell says that some obstacle of that height stands in it, not where; it counts as a
    square of half the cell's side at its centre, because taking the whole cell would
    obstruct links that pass beside the obstacle in the next lane. When merged, a body known
    otherwise explains every cell that it reaches into.
    """
    if apm.layer is None:
        return Obstacles()
    occupied = np.nonzero(apm.layer["height"])
    cells = apm.layer[occupied]
    count = len(cells)
    return Obstacles(
        owner=np.full(count, NO_VEHICLE, np.int64),
        center=apm.world(np.stack(occupied, axis=1) + 0.5),
        heading=np.full(count, apm.heading),
        half=np.full((count, 2), apm.cell / 4.0),
        height=layer_height(cells),
        velocity=layer_velocity(cells),
    )


def merge(sources: Iterable[tuple[Obstacles, float]]) -> Obstacles:
    """All obstacles, each body once.

    Args:
        sources: in order of trust, each with the margin within which the centre of one of
            its obstacles means a body already known [m].
    """
    merged = Obstacles()
    for source, margin in sources:
        merged = merged.joined(source.without(~merged.explain(source, margin)))
    return merged
