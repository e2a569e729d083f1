"""Roadside units: radios on masts beside the road, which SUMO knows nothing of.

To the other components a roadside unit is one more row of `vehicle.*`: equipped, at rest, without
a lidar, there for the whole run. Its body is a cube of a millimetre on the ground, which neither
lidar nor radio can notice; docs/physics-traffic.md says what a real mast would do.
"""

from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np
import numpy.typing as npt

from adapters.sumo.fleet import Part
from adapters.sumo.road import Road
from adapters.sumo.scene import BODIES, Buildings, frozen
from adapters.sumo.simulation import SumoError
from adapters.traffic.geometry import Float
from orchestrator.signal import Array

FIRST_NUMBER: Final = 1_000_000
"""`vehicle.id` of the first roadside unit: above those of all vehicles, so that theirs, and the
units' own, do not depend on who else is there."""

BODY_SIZE: Final = 0.001
"""Length, width and height of the body [m]."""


class RoadsideUnits:
    """All roadside units of a run, joined to the vehicles.

    Args:
        positions: of the masts, x and y [m] each.
        antenna_height: of all of them, above the ground [m].
    """

    def __init__(self, positions: Sequence[Sequence[float]], antenna_height: float) -> None:
        self._rows = _rows(np.array(positions, dtype=np.float64), antenna_height)
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
    positions: Sequence[Sequence[float]],
    antenna_height: float,
    *,
    buildings: Buildings,
    road: Road,
    tallest: float,
) -> None:
    """Refuse antennas within a building, or where vehicles drive through them.

    Args:
        positions: of the masts, x and y [m] each.
        antenna_height: of all of them [m].
        buildings: of the scene.
        road: of the scene.
        tallest: height of the tallest vehicle type [m].

    Raises:
        SumoError: where an antenna cannot be, and what to change; all of them.
    """
    problems = []
    for k, (x, y) in enumerate(positions):
        place = f"`rsu_positions`: roadside unit {k} at ({x:g}, {y:g}) m"
        around = [
            float(height)
            for building, height in enumerate(buildings.height)
            if contains(buildings.vertex[buildings.index == building], x, y)
        ]
        rings = (road.vertex[road.index == ring] for ring in np.unique(road.index))
        if around and antenna_height <= max(around):
            problems.append(
                f"{place} is inside a building of {max(around):g} m; move it out, or raise "
                f"`rsu_antenna_height`, {antenna_height:g} m, above the roof"
            )
        elif antenna_height <= tallest and any(contains(ring, x, y) for ring in rings):
            problems.append(
                f"{place} is on the road, where vehicles are up to {tallest:g} m high; move it off "
                f"the road, or raise `rsu_antenna_height`, {antenna_height:g} m, above them"
            )
    if problems:
        raise SumoError("\n".join(problems))


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


def _rows(positions: Float, antenna_height: float) -> Mapping[str, npt.NDArray[np.generic]]:
    """The units' rows of each connector `vehicle.*`; nothing if there are no units."""
    count = len(positions)
    if count == 0:
        return {}
    return {
        "vehicle.id": np.arange(FIRST_NUMBER, FIRST_NUMBER + count, dtype=np.int64),
        "vehicle.position": np.column_stack([positions, np.zeros(count)]),
        "vehicle.heading": np.zeros(count),
        "vehicle.velocity": np.zeros((count, 2)),
        "vehicle.size": np.full((count, 3), BODY_SIZE),
        "vehicle.antenna_height": np.full(count, antenna_height),
        "vehicle.body": np.full(count, BODIES["car"], dtype=np.int32),
        "vehicle.equipped": np.ones(count, dtype=np.bool_),
        "vehicle.lidar": np.zeros(count, dtype=np.bool_),
        "vehicle.role": np.full(count, Part.ROADSIDE, dtype=np.int32),
    }
