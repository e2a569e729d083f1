"""Buildings between the arms of a road."""

from collections.abc import Iterable, Iterator
from typing import Final

import numpy as np
import shapely
from shapely.geometry import LineString, Point, Polygon
from shapely.geometry.base import BaseGeometry

from studies.verification.perception.road import Arm, Road
from studies.verification.perception.scene import Building

EXTENT: Final = 80.0
"""Buildings stand within this distance of the junction [m]."""
_SMALLEST: Final = 30.0
"""Footprint [m^2]; smaller rests are left out."""


def draw_buildings(rng: np.random.Generator, road: Road) -> tuple[Building, ...]:
    """Nothing, solid blocks or rows of houses between each two arms.

    Set-back from the road 1.5 to 14 m. Rows are 8 to 18 m deep, follow both roads round the
    corner (and are then not convex) and have gaps. Heights 3 to 25 m.
    """
    found: list[Building] = []
    for k, arm in enumerate(road.arms):
        after = road.arms[(k + 1) % len(road.arms)]
        kind = rng.choice(["open", "row", "block"], p=[0.25, 0.5, 0.25])
        setback, depth = rng.uniform(1.5, 14), rng.uniform(8, 18)
        gaps = [_gap(rng, side) for side in (arm, after) for _ in range(int(rng.integers(0, 3)))]
        if kind == "open":
            continue
        land = _land(road, arm, after, setback)
        if kind == "row":
            strip = road.surface.buffer(setback + depth, join_style="bevel")
            land = land.intersection(strip)
        land = land.difference(shapely.union_all(gaps))
        for ring in _rings(land):
            height = rng.uniform(3, 5) if rng.random() < 0.1 else rng.uniform(6, 25)
            found.append(Building(ring=ring, height=height))
    return tuple(found)


def _gap(rng: np.random.Generator, arm: Arm) -> BaseGeometry:
    """An alley across `arm`."""
    distance, width = rng.uniform(15, EXTENT - 5), rng.uniform(3, 15)
    across = LineString([arm.at(distance, -2 * EXTENT), arm.at(distance, 2 * EXTENT)])
    return across.buffer(width / 2, cap_style="flat")


def _land(road: Road, arm: Arm, after: Arm, setback: float) -> BaseGeometry:
    """What lies between two arms."""
    turn = (after.heading - arm.heading) % (2 * np.pi)
    middle = Arm(arm.heading + turn / 2, 0).at(0.9 * EXTENT, 0.0)
    square = Point(0, 0).buffer(EXTENT, quad_segs=3)
    free = square.difference(road.surface.buffer(setback, join_style="bevel"))
    return min(_parts(free), key=lambda part: float(part.distance(Point(middle))))


def _parts(geometry: BaseGeometry) -> Iterator[Polygon]:
    for part in shapely.get_parts(geometry):
        if isinstance(part, Polygon):
            yield part


def _rings(geometry: BaseGeometry) -> Iterable[tuple[tuple[float, float], ...]]:
    for part in _parts(geometry.simplify(0.05)):
        if part.area >= _SMALLEST:
            yield tuple((float(x), float(y)) for x, y in part.exterior.coords[:-1])
