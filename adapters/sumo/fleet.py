"""The vehicles present, their numbers and the attributes that never change."""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum
from functools import cached_property

import numpy as np
import numpy.typing as npt

from adapters.sumo.scene import VehicleType
from adapters.traffic.geometry import Float, direction, wrap


class Part(IntEnum):
    """The part a vehicle plays in the case study; the numbers are those of `vehicle.role`.

    `studies.red_light.traces`, which reads recordings without SUMO, has them too; a test compares.
    """

    BACKGROUND = 0
    EGO = 1
    COLLISION = 2
    SHARING = 3
    BLOCKING = 4
    ROADSIDE = 5


@dataclass(frozen=True, slots=True, kw_only=True)
class Vehicle:
    """A vehicle and what it carries.

    Attributes:
        name: in SUMO.
        equipped: has a V2X radio.
        lidar: carries a lidar.
        part: it plays; for evaluation, no unit knows it.
    """

    name: str
    type: VehicleType
    equipped: bool
    lidar: bool
    part: Part = Part.BACKGROUND


class Roster:
    """Vehicles present in ascending order of their numbers; immutable.

    A new roster is made when somebody enters or leaves, so that its arrays stay the same objects
    while nobody does.
    """

    def __init__(self, vehicles: Sequence[Vehicle], numbers: Sequence[int], following: int) -> None:
        """Make a roster.

        Args:
            vehicles: those present.
            numbers: theirs, ascending.
            following: the number of the next vehicle to enter.
        """
        self.vehicles = tuple(vehicles)
        self.names = tuple(vehicle.name for vehicle in self.vehicles)
        self._numbers = tuple(numbers)
        self._following = following

    @classmethod
    def empty(cls) -> "Roster":
        """Nobody yet."""
        return cls((), (), 0)

    def changed(self, entered: Sequence[Vehicle], left: frozenset[str]) -> "Roster":
        """The roster after `entered`, in this order, came and `left` went."""
        if not entered and left.isdisjoint(self.names):
            return self
        stayed = [
            pair
            for pair in zip(self.vehicles, self._numbers, strict=True)
            if pair[0].name not in left
        ]
        following = self._following + len(entered)
        vehicles = [vehicle for vehicle, _ in stayed] + list(entered)
        numbers = [number for _, number in stayed] + list(range(self._following, following))
        return Roster(vehicles, numbers, following)

    def row(self, name: str) -> int | None:
        """The index of the vehicle called `name`, if it is present."""
        return self.names.index(name) if name in self.names else None

    @cached_property
    def number(self) -> npt.NDArray[np.int64]:
        """`vehicle.id`, shape (vehicle,)."""
        return np.array(self._numbers, dtype=np.int64)

    @cached_property
    def size(self) -> Float:
        """Length, width and height [m], shape (vehicle, 3)."""
        sizes = [vehicle.type.size for vehicle in self.vehicles]
        return np.array(sizes, dtype=np.float64).reshape(-1, 3)

    @cached_property
    def antenna_height(self) -> Float:
        """Heights of the antennas above the ground [m], shape (vehicle,)."""
        return np.array([v.type.antenna_height for v in self.vehicles], dtype=np.float64)

    @cached_property
    def body(self) -> npt.NDArray[np.int32]:
        """Body code, shape (vehicle,)."""
        return np.array([vehicle.type.body for vehicle in self.vehicles], dtype=np.int32)

    @cached_property
    def equipped(self) -> npt.NDArray[np.bool_]:
        """Who has a radio, shape (vehicle,)."""
        return np.array([vehicle.equipped for vehicle in self.vehicles], dtype=np.bool_)

    @cached_property
    def lidar(self) -> npt.NDArray[np.bool_]:
        """Who carries a lidar, shape (vehicle,)."""
        return np.array([vehicle.lidar for vehicle in self.vehicles], dtype=np.bool_)

    @cached_property
    def role(self) -> npt.NDArray[np.int32]:
        """The part each plays, shape (vehicle,)."""
        return np.array([vehicle.part for vehicle in self.vehicles], dtype=np.int32)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Poses:
    """Where the vehicles of a roster are, in its order.

    Attributes:
        center: of the bodies [m], shape (vehicle, 2).
        heading: counter-clockwise from east [rad], shape (vehicle,).
        velocity: [m/s], shape (vehicle, 2).
    """

    center: Float
    heading: Float
    velocity: Float

    @classmethod
    def from_sumo(cls, poses: Float, length: Float) -> "Poses":
        """Convert SUMO's front bumper and clockwise degrees from north.

        Args:
            poses: as `Sumo.poses` returns them, shape (vehicle, 4).
            length: of the bodies [m], shape (vehicle,).
        """
        heading = wrap(np.radians(90.0 - poses[:, 2]))
        ahead = direction(heading)
        return cls(
            center=poses[:, :2] - 0.5 * length[:, None] * ahead,
            heading=heading,
            velocity=poses[:, 3:] * ahead,
        )

    def rows(self, chosen: npt.NDArray[np.intp]) -> "Poses":
        """The poses in the rows `chosen`, shape (row,)."""
        return Poses(
            center=self.center[chosen],
            heading=self.heading[chosen],
            velocity=self.velocity[chosen],
        )
