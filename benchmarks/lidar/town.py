"""What the sensors see: a square of streets and buildings with vehicles that drive."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from orchestrator.signal import Array

Float = npt.NDArray[np.float64]

SIDE: Final = 300.0
"""The side of the square [m], as in the survey of ray casters from which the targets come."""

BUILDINGS: Final = 20
INTERVAL: Final = 0.1
"""Time between two scans [s]: a lidar turns at 10 Hz."""

SCANS: Final = 20
"""Different scenes, one for each scan: two seconds."""

_STREETS: Final = (-120.0, -40.0, 40.0, 120.0)
"""Their middles, both ways [m]."""

_LANES: Final = (-5.25, -1.75, 1.75, 5.25)
"""Their middles, from that of the street [m]; right-hand traffic."""

_SLOT: Final = 12.5
"""Length of street that a vehicle has for itself [m], longer than a bus."""

_CROSSING: Final = 9.0
"""Half the side of the squares where streets meet, kept free at the beginning [m]."""

_BODIES: Final = (  # share, class, length, width, height [m]
    (0.60, 0, 4.5, 1.8, 1.5),
    (0.20, 1, 4.7, 1.9, 1.8),
    (0.10, 2, 5.9, 2.0, 2.5),
    (0.05, 3, 12.0, 2.5, 3.2),
    (0.05, 4, 10.0, 2.5, 3.8),
)

_SHAPES: Final = (
    ((-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)),
    ((-1.0, -1.0), (1.0, -1.0), (1.0, 0.0), (0.0, 0.0), (0.0, 1.0), (-1.0, 1.0)),
    tuple((math.cos(k * math.pi / 4), math.sin(k * math.pi / 4)) for k in range(8)),
)
"""A rectangle, an L and an octagon."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Town:
    """Vehicles on streets among buildings; every vehicle moves between two scans.

    Attributes:
        position: centre of each footprint [m], shape (scan, vehicle, 3).
        heading: [rad], shape (scan, vehicle).
        size: length, width, height [m], shape (vehicle, 3).
        body: classes, shape (vehicle,).
        lidar: who carries a sensor, shape (vehicle,); cars only.
        vertex: corners of all buildings, ring by ring [m], shape (corner, 2).
        index: the building of each corner, shape (corner,).
        height: of the buildings [m], shape (building,).
    """

    position: Float
    heading: Float
    size: Float
    body: npt.NDArray[np.int32]
    lidar: npt.NDArray[np.bool_]
    vertex: Float
    index: npt.NDArray[np.int32]
    height: Float

    @property
    def vehicles(self) -> int:
        """How many vehicles there are."""
        return len(self.size)

    @property
    def sensors(self) -> Sequence[int]:
        """The vehicles that carry a lidar."""
        return [int(k) for k in np.flatnonzero(self.lidar)]

    def inputs(self) -> Sequence[Mapping[str, Array]]:
        """The signals `vehicle.*` and `building.*` of each scan, in the units of these connectors.

        Those of vehicles have shape (vehicle, ...), `building.vertex` (corner, 2),
        `building.index` (corner,) and `building.height` (building,). What stays is the same object
        every time.
        """
        still = {
            "vehicle.id": _read_only(np.arange(self.vehicles, dtype=np.int64)),
            "vehicle.size": _read_only(self.size),
            "vehicle.body": _read_only(self.body),
            "vehicle.lidar": _read_only(self.lidar),
            "building.vertex": _read_only(self.vertex),
            "building.index": _read_only(self.index),
            "building.height": _read_only(self.height),
        }
        return [
            still
            | {
                "vehicle.position": _read_only(self.position[k]),
                "vehicle.heading": _read_only(self.heading[k]),
            }
            for k in range(len(self.position))
        ]


def _read_only(array: Array) -> Array:
    array.flags.writeable = False
    return array


def town(vehicles: int, sensors: int) -> Town:
    """A town, alike at every call. Vehicles drive straight on, at crossings through each other.

    Args:
        vehicles: how many, at most 576.
        sensors: how many of the cars nearest to the middle carry a lidar.
    """
    rng = np.random.default_rng(1)
    start, heading = _slots()
    chosen = rng.choice(len(start), vehicles, replace=False)
    kind = rng.choice(len(_BODIES), vehicles, p=[share for share, *_ in _BODIES])
    speed = rng.uniform(5.0, 15.0, vehicles)
    ahead = np.stack([np.cos(heading[chosen]), np.sin(heading[chosen])], axis=-1)
    time = INTERVAL * np.arange(SCANS)[:, np.newaxis, np.newaxis]
    position = np.zeros((SCANS, vehicles, 3))
    position[..., :2] = start[chosen] + time * (speed[:, np.newaxis] * ahead)
    turned = heading[chosen] + 0.02 * rng.standard_normal((SCANS, vehicles))  # they sway
    cars = np.flatnonzero(kind == 0)
    middle = np.argsort(np.abs(start[chosen[cars]]).max(axis=1), kind="stable")
    vertex, index, height = _buildings(rng)
    return Town(
        position=position,
        heading=turned,
        size=np.array([size for _, _, *size in _BODIES])[kind],
        body=np.array([body for _, body, *_ in _BODIES], np.int32)[kind],
        lidar=np.isin(np.arange(vehicles), cars[middle[:sensors]]),
        vertex=vertex,
        index=index,
        height=height,
    )


def _slots() -> tuple[Float, Float]:
    """Places for vehicles [m], shape (slot, 2), and their headings [rad], shape (slot,)."""
    along = np.arange(-SIDE / 2 + _SLOT / 2, SIDE / 2, _SLOT)
    free = np.abs(along[:, np.newaxis] - np.array(_STREETS)).min(axis=1) > _CROSSING
    east, north = [], []
    for street in _STREETS:
        for lane in _LANES:
            for x in along[free]:
                east.append((x, street + lane, 0.0 if lane < 0 else math.pi))
                north.append((street - lane, x, math.pi / 2 if lane < 0 else -math.pi / 2))
    found = np.array(east + north)
    return found[:, :2], found[:, 2]


def _buildings(
    rng: np.random.Generator,
) -> tuple[Float, npt.NDArray[np.int32], Float]:
    """Corners, their buildings, and heights; four places in each of the nine inner blocks."""
    places = [(x + dx, y + dy) for x in (-80.0, 0.0, 80.0) for y in (-80.0, 0.0, 80.0)
              for dx in (-15.0, 15.0) for dy in (-15.0, 15.0)]  # fmt: skip
    rings = []
    for place in rng.choice(len(places), BUILDINGS, replace=False):
        shape = np.array(_SHAPES[int(rng.integers(len(_SHAPES)))]) * rng.uniform(7.0, 12.0, 2)
        turn = rng.uniform(-0.1, 0.1)
        c, s = math.cos(turn), math.sin(turn)
        rings.append(shape @ np.array([[c, s], [-s, c]]) + places[place])
    index = np.repeat(np.arange(BUILDINGS), [len(ring) for ring in rings]).astype(np.int32)
    return np.concatenate(rings), index, rng.uniform(6.0, 20.0, BUILDINGS)
