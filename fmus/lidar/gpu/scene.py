"""What a sensor can see, in the world frame: upright prisms over a flat ground at z = 0."""

from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from fmus.lidar.gpu.inputs import Inputs
from fmus.messages.records import BUILDING

Float = npt.NDArray[np.float64]
Int = npt.NDArray[np.int64]

GROUND_REFLECTIVITY: Final = 0.2
BUILDING_REFLECTIVITY: Final = 0.4
VEHICLE_REFLECTIVITY: Final = 0.5
NO_OWNER: Final = -1

BODIES: Final = (
    ((-0.50, 0.50, 1.00, 0.00, 0.62), (-0.36, 0.16, 0.85, 0.62, 1.00)),  # car
    ((-0.50, 0.50, 1.00, 0.00, 0.62), (-0.48, 0.20, 0.88, 0.62, 1.00)),  # SUV, MPV
    ((-0.50, 0.50, 1.00, 0.00, 0.50), (-0.50, 0.36, 1.00, 0.50, 1.00)),  # van
    ((-0.50, 0.50, 1.00, 0.00, 1.00),),  # bus
    (
        (-0.50, 0.50, 1.00, 0.00, 0.30),
        (0.28, 0.50, 1.00, 0.30, 0.90),
        (-0.50, 0.24, 1.00, 0.30, 1.00),
    ),  # truck
    (
        (-0.49, 0.49, 0.85, 0.00, 0.12),
        (-0.50, 0.50, 1.00, 0.12, 0.88),
        (-0.45, 0.45, 0.70, 0.88, 1.00),
    ),  # tram, train
    (
        (-0.50, 0.50, 0.35, 0.00, 0.53),
        (-0.15, 0.15, 0.65, 0.18, 0.53),
        (-0.20, 0.18, 0.60, 0.53, 0.83),
        (-0.02, 0.12, 0.28, 0.83, 1.00),
    ),  # motorcycle
    (
        (-0.50, 0.50, 0.12, 0.00, 0.41),
        (-0.15, 0.15, 0.55, 0.06, 0.56),
        (-0.20, 0.22, 0.75, 0.56, 0.84),
        (0.05, 0.20, 0.25, 0.84, 1.00),
    ),  # bicycle
    (
        (-0.50, 0.50, 0.70, 0.00, 0.48),
        (-0.50, 0.50, 1.00, 0.48, 0.82),
        (-0.45, 0.45, 0.32, 0.82, 1.00),
    ),  # pedestrian
)
"""Boxes of each class of `vehicle.body`: rear, front (of the length), width, bottom, top (of the
height); the table of docs/physics-lidar.md."""

_PARTS: Final = np.array([part for body in BODIES for part in body])
_PART_COUNT: Final = np.array([len(body) for body in BODIES], np.int64)
_FIRST_PART: Final = np.cumsum(_PART_COUNT) - _PART_COUNT


@dataclass(frozen=True, slots=True, kw_only=True)
class Prisms:
    """Upright prisms; the corners of all rings lie one after another, counter-clockwise.

    Attributes:
        corner: [m], shape (corner, 2).
        count: corners of each ring, shape (prism,).
        bottom, top: [m], shape (prism,).
        instance: what a point on it says, shape (prism,).
        reflectivity: at normal incidence, 0..1, shape (prism,).
        owner: index of the vehicle it is part of, or `NO_OWNER`, shape (prism,).
    """

    corner: Float
    count: Int
    bottom: Float
    top: Float
    instance: Int
    reflectivity: Float
    owner: Int

    @property
    def first(self) -> Int:
        """Indices of the first corner of each ring, shape (prism,)."""
        return np.asarray(np.cumsum(self.count) - self.count, np.int64)

    def circles(self) -> Float:
        """A circle around each ring.

        Returns:
            x, y of the centre of its bounding box and the radius [m], shape (prism, 3).
        """
        if len(self.count) == 0:
            return np.zeros((0, 3))
        low = np.minimum.reduceat(self.corner, self.first)
        high = np.maximum.reduceat(self.corner, self.first)
        center = 0.5 * (low + high)
        offset = self.corner - np.repeat(center, self.count, axis=0)
        radius = np.sqrt(np.maximum.reduceat((offset**2).sum(axis=1), self.first))
        return np.column_stack([center, radius])


def prisms(inputs: Inputs) -> Prisms:
    """The prisms of checked inputs: buildings, then the parts of the vehicles."""
    houses, bodies = _buildings(inputs), _bodies(inputs)
    return Prisms(
        corner=np.concatenate([houses.corner, bodies.corner]),
        count=np.concatenate([houses.count, bodies.count]),
        bottom=np.concatenate([houses.bottom, bodies.bottom]),
        top=np.concatenate([houses.top, bodies.top]),
        instance=np.concatenate([houses.instance, bodies.instance]),
        reflectivity=np.concatenate([houses.reflectivity, bodies.reflectivity]),
        owner=np.concatenate([houses.owner, bodies.owner]),
    )


def _buildings(inputs: Inputs) -> Prisms:
    vertex, height = inputs.building_vertex, inputs.building_height
    index = inputs.building_index.astype(np.int64)
    count = np.bincount(index, minlength=len(height)).astype(np.int64)
    first, corner = (np.cumsum(count) - count)[index], np.arange(len(index), dtype=np.int64)
    following = np.where(corner + 1 < first + count[index], corner + 1, first)
    # twice the signed area, about the first corner so that large coordinates do not cancel
    a, b = vertex - vertex[first], vertex[following] - vertex[first]
    area = np.bincount(index, a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0], minlength=len(height))
    mirrored = 2 * first + count[index] - 1 - corner
    return Prisms(
        corner=vertex[np.where(area[index] < 0.0, mirrored, corner)],
        count=count,
        bottom=np.zeros(len(height)),
        top=height,
        instance=BUILDING - np.arange(len(height), dtype=np.int64),
        reflectivity=np.full(len(height), BUILDING_REFLECTIVITY),
        owner=np.full(len(height), NO_OWNER, np.int64),
    )


def _bodies(inputs: Inputs) -> Prisms:
    body = inputs.body.astype(np.int64)
    count = _PART_COUNT[body]
    owner = np.repeat(np.arange(len(body), dtype=np.int64), count)
    number = np.arange(len(owner), dtype=np.int64) - np.repeat(np.cumsum(count) - count, count)
    rear, front, width, bottom, top = _PARTS[_FIRST_PART[body[owner]] + number].T
    length, across, height = inputs.size[owner].T
    ends = np.stack([rear, front, front, rear], axis=1) * length[:, None]
    sides = np.array([-0.5, -0.5, 0.5, 0.5]) * (across * width)[:, None]
    cosine, sine = np.cos(inputs.heading)[owner, None], np.sin(inputs.heading)[owner, None]
    x, y, z = inputs.position[owner].T
    ring = np.stack(
        [
            x[:, None] + cosine * ends - sine * sides,
            y[:, None] + sine * ends + cosine * sides,
        ],
        axis=2,
    )
    return Prisms(
        corner=ring.reshape(-1, 2),
        count=np.full(len(owner), 4, np.int64),
        bottom=z + bottom * height,
        top=z + top * height,
        instance=inputs.id[owner],
        reflectivity=np.full(len(owner), VEHICLE_REFLECTIVITY),
        owner=owner,
    )
