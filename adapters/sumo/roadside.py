"""Roadside units: radios on masts beside the road, which SUMO knows nothing of.

To the other components a roadside unit is one more row of `vehicle.*`: equipped, at rest, without
a lidar, there for the whole run. Its body is a cube of a millimetre on the ground, which neither
lidar nor radio can notice; docs/physics-traffic.md says what a real mast would do.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from adapters.sumo.entities import Entity
from adapters.sumo.errors import SumoError
from adapters.sumo.placement import place_of
from adapters.sumo.scene import frozen
from adapters.traffic.bodies import Body
from adapters.traffic.geometry import Float
from adapters.traffic.surroundings import Buildings, RoadSurface
from orchestrator.signal import Array

FIRST_NUMBER: Final = 1_000_000
"""`vehicle.id` of the first roadside unit: above those of all vehicles, so that theirs, and the
units' own, do not depend on who else is there."""

BODY_SIZE: Final = 0.001
"""Length, width and height of the body [m]."""

_ANTENNA_HEIGHT: Final = 5.0
"""The height of roadside units' antennas that say none [m]: TR 37.885, table 6.1.4-1."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RoadsideUnit:
    """A radio on a mast.

    Attributes:
        name: in the scenario.
        x, y: of the mast [m].
        antenna_height: above the ground [m].
        role: which entity of the scenario it is, from 1.
    """

    name: str
    x: float
    y: float
    antenna_height: float
    role: int


def units_of(entities: Mapping[str, Entity | None]) -> list[RoadsideUnit]:
    """The roadside units among `entities`, in the order of their declarations.

    Raises:
        SumoError: one has no place; all of them are named.
    """
    units, problems = [], []
    for role, (name, entity) in enumerate(entities.items(), start=1):
        if entity is None or not entity.is_roadside_unit or entity.presence <= 0.0:
            continue
        place = place_of(entity.position.x, entity.position.y)
        if place is None:
            problems.append(f"`entities.{name}`: a roadside unit needs `position.x` and `.y`")
            continue
        height = _ANTENNA_HEIGHT if entity.antenna_height is None else entity.antenna_height
        units.append(
            RoadsideUnit(name=name, x=place[0], y=place[1], antenna_height=height, role=role)
        )
    if problems:
        raise SumoError("\n".join(problems))
    return units


class RoadsideUnits:
    """All roadside units of a run, joined to the vehicles.

    Args:
        units: in the order of their numbers.
    """

    def __init__(self, units: Sequence[RoadsideUnit]) -> None:
        self._rows = _rows(units)
        self._joined: dict[str, tuple[Array, Array]] = {}

    def join(self, signals: Mapping[str, Array]) -> dict[str, Array]:
        """`signals` with the units behind the vehicles in `vehicle.*`.

        What is the same object as at the last call is so in the result.

        Args:
            signals: values of connectors by name; those of `vehicle.*` have shape (vehicle, ...),
                others any shape.

        Returns:
            All signals; those of `vehicle.*` have shape (vehicle + unit, ...).
        """
        return {**signals, **{name: self._join(name, signals[name]) for name in self._rows}}

    def _join(self, name: str, vehicles: Array) -> Array:
        known = self._joined.get(name)
        if known is None or known[0] is not vehicles:
            known = (vehicles, frozen(np.concatenate([vehicles, self._rows[name]])))
            self._joined[name] = known
        return known[1]


def check_places(
    units: Sequence[RoadsideUnit], *, buildings: Buildings, road: RoadSurface, tallest: float
) -> None:
    """Refuse antennas within a building, or where vehicles drive through them.

    Args:
        units: at their places.
        buildings: of the scene.
        road: of the scene.
        tallest: height of the tallest vehicle type of the scene [m].

    Raises:
        SumoError: where an antenna cannot be, and what to change; all of them.
    """
    problems = []
    walls, lanes = _Rings(buildings.vertex, buildings.index), _Rings(road.vertex, road.index)
    for unit in units:
        x, y, antenna_height = unit.x, unit.y, unit.antenna_height
        place = f"`entities.{unit.name}`: the roadside unit at ({x:g}, {y:g}) m"
        around = [float(buildings.height[building]) for building in walls.around(x, y)]
        if around and antenna_height <= max(around):
            problems.append(
                f"{place} is inside a building of {max(around):g} m; move it out, or raise "
                f"`antenna_height`, {antenna_height:g} m, above the roof"
            )
        elif antenna_height <= tallest and lanes.around(x, y):
            problems.append(
                f"{place} is on the road, where vehicles are up to {tallest:g} m high; move it off "
                f"the road, or raise `antenna_height`, {antenna_height:g} m, above them"
            )
    if problems:
        raise SumoError("\n".join(problems))


class _Rings:
    """Polygons of which few are near any point.

    Args:
        vertex: corners of all, one polygon after the other [m], shape (vertex, 2).
        index: the polygon of each, ascending, shape (vertex,).
    """

    def __init__(self, vertex: Float, index: npt.NDArray[np.int32]) -> None:
        self._names, starts = np.unique(index, return_index=True)
        self._parts = np.split(vertex, starts[1:])
        self._low = np.array([part.min(axis=0) for part in self._parts if len(part)])
        self._high = np.array([part.max(axis=0) for part in self._parts if len(part)])

    def around(self, x: float, y: float) -> list[int]:
        """The polygons that contain the point x, y [m]."""
        if not len(self._names):
            return []
        at = (x, y)
        near = np.flatnonzero(((self._low <= at) & (at <= self._high)).all(axis=1))
        return [int(self._names[k]) for k in near if contains(self._parts[k], x, y)]


def contains(ring: Float, x: float, y: float) -> bool:
    """Whether a point lies in a simple polygon (even-odd rule).

    Args:
        ring: corners [m], an open ring, shape (corner, 2).
        x: of the point [m].
        y: of the point [m].
    """
    a, b = ring - (x, y), np.roll(ring, -1, axis=0) - (x, y)
    straddles = (a[:, 1] > 0.0) != (b[:, 1] > 0.0)
    cross = a[:, 0] * b[:, 1] - b[:, 0] * a[:, 1]  # its sign: the side of the point
    to_the_right = (cross > 0.0) == (b[:, 1] > a[:, 1])
    return bool(np.count_nonzero(straddles & to_the_right) % 2)


def _rows(units: Sequence[RoadsideUnit]) -> Mapping[str, npt.NDArray[np.generic]]:
    """The units' rows of each connector `vehicle.*`; nothing if there are no units."""
    count = len(units)
    if count == 0:
        return {}
    return {
        "vehicle.id": np.arange(FIRST_NUMBER, FIRST_NUMBER + count, dtype=np.int64),
        "vehicle.position": np.array([(unit.x, unit.y, 0.0) for unit in units]),
        "vehicle.heading": np.zeros(count),
        "vehicle.velocity": np.zeros((count, 2)),
        "vehicle.size": np.full((count, 3), BODY_SIZE),
        "vehicle.antenna_height": np.array([unit.antenna_height for unit in units]),
        "vehicle.body": np.full(count, Body.CAR, dtype=np.int32),
        "vehicle.equipped": np.ones(count, dtype=np.bool_),
        "vehicle.lidar": np.zeros(count, dtype=np.bool_),
        "vehicle.role": np.array([unit.role for unit in units], dtype=np.int32),
    }
