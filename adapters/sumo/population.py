"""The vehicles present, their numbers and the attributes that never change."""

from collections.abc import Mapping, Sequence, Set
from dataclasses import dataclass
from enum import Enum
from functools import cached_property
from typing import Final

import numpy as np
import numpy.typing as npt

from adapters.sumo.scene import VehicleType
from adapters.traffic.geometry import Float, direction, wrap


class Kind(Enum):
    """What a road user is to SUMO."""

    VEHICLE = "vehicle"
    PERSON = "person"
    UNIT = "roadside unit"


UNDECLARED: Final = 0
"""`vehicle.role` of those that are no entities."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Vehicle:
    """A road user and what it carries.

    Attributes:
        name: in SUMO.
        equipped: has a V2X radio.
        lidar: carries a lidar.
        role: which entity of the scenario it is, from 1; `UNDECLARED` if none. For evaluation: no
            unit knows it.
        antenna_height: above the ground [m].
        kind: what it is to SUMO.
    """

    name: str
    type: VehicleType
    equipped: bool
    lidar: bool
    antenna_height: float
    role: int = UNDECLARED
    kind: Kind = Kind.VEHICLE

    @property
    def key(self) -> str:
        """Tells it from all others; vehicles and persons of SUMO may share a name."""
        return key_of(self.name, self.kind)


def key_of(name: str, kind: Kind) -> str:
    """What tells `name` of a kind from all others."""
    return name if kind is Kind.VEHICLE else f"{kind.value}\0{name}"


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
        self._rows = {vehicle.key: row for row, vehicle in enumerate(self.vehicles)}
        self._numbers = tuple(numbers)
        self._following = following

    @classmethod
    def empty(cls) -> "Roster":
        """Nobody yet."""
        return cls((), (), 0)

    def changed(self, entered: Sequence[Vehicle], left: frozenset[str]) -> "Roster":
        """The roster after `entered`, in this order, came and `left` went."""
        if not entered and left.isdisjoint(self._rows):
            return self
        stayed = [
            pair
            for pair in zip(self.vehicles, self._numbers, strict=True)
            if pair[0].key not in left
        ]
        following = self._following + len(entered)
        vehicles = [vehicle for vehicle, _ in stayed] + list(entered)
        numbers = [number for _, number in stayed] + list(range(self._following, following))
        return Roster(vehicles, numbers, following)

    @property
    def keys(self) -> Set[str]:
        """The keys of all."""
        return self._rows.keys()

    def row(self, key: str) -> int | None:
        """The index of the one whose key is `key`, if it is present."""
        return self._rows.get(key)

    def of(self, key: str) -> Vehicle:
        """The one whose key is `key`.

        Raises:
            KeyError: nobody present has it.
        """
        return self.vehicles[self._rows[key]]

    def number_of(self, key: str) -> int:
        """The number of the one whose key is `key`.

        Raises:
            KeyError: nobody present has it.
        """
        return self._numbers[self._rows[key]]

    @cached_property
    def has_persons(self) -> bool:
        """Whether somebody is on foot."""
        return any(vehicle.kind is Kind.PERSON for vehicle in self.vehicles)

    @cached_property
    def of_kinds(self) -> Mapping[Kind, tuple[npt.NDArray[np.intp], tuple[str, ...]]]:
        """Rows, shape (row,), and names of each kind that SUMO has."""
        found = {}
        for kind in (Kind.VEHICLE, Kind.PERSON):
            rows = [row for row, vehicle in enumerate(self.vehicles) if vehicle.kind is kind]
            found[kind] = np.array(rows, dtype=np.intp), tuple(self.names[row] for row in rows)
        return found

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
        return np.array([v.antenna_height for v in self.vehicles], dtype=np.float64)

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
        """Which entity each is, shape (vehicle,)."""
        return np.array([vehicle.role for vehicle in self.vehicles], dtype=np.int32)


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
    def nobody(cls) -> "Poses":
        """The poses of an empty roster."""
        return cls(center=np.zeros((0, 2)), heading=np.zeros(0), velocity=np.zeros((0, 2)))

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
