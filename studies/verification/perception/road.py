"""Roads of a scene: arms that meet in a junction, ways through it, and the houses beside."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
import shapely
from shapely.geometry import LineString, MultiPoint, Point, Polygon
from shapely.geometry.base import BaseGeometry

from studies.verification.perception.scene import Building, Float

LANE_WIDTH: Final = 3.2
"""Width of every lane [m]."""
LENGTH: Final = 110.0
"""Length of every arm from the middle of the junction [m]; farther than any sensor sees."""


@dataclass(frozen=True, slots=True)
class Arm:
    """A street that leads away from the junction. Traffic keeps to the right.

    Attributes:
        heading: outwards [rad].
        lanes: per direction.
    """

    heading: float
    lanes: int

    @property
    def half_width(self) -> float:
        """Width of the lanes of one direction [m]."""
        return self.lanes * LANE_WIDTH

    def at(self, distance: float, left: float) -> Float:
        """The point `distance` outwards and `left` of the middle line [m], shape (2,)."""
        cosine, sine = np.cos(self.heading), np.sin(self.heading)
        return np.array([distance * cosine - left * sine, distance * sine + left * cosine])

    def inbound(self, distance: float, lane: int) -> Float:
        """A point [m] on an inbound lane, counted from the middle line, shape (2,)."""
        return self.at(distance, (lane + 0.5) * LANE_WIDTH)

    def outbound(self, distance: float, lane: int) -> Float:
        """A point [m] on an outbound lane, counted from the middle line, shape (2,)."""
        return self.at(distance, -(lane + 0.5) * LANE_WIDTH)

    @property
    def surface(self) -> Polygon:
        """The surface of all its lanes [m]."""
        half = self.half_width
        ring = [(0, -half), (LENGTH, -half), (LENGTH, half), (0, half)]
        return Polygon([self.at(*corner) for corner in ring])


@dataclass(frozen=True, slots=True)
class Road:
    """Arms around the origin.

    Attributes:
        arms: by ascending heading; two of them are a road without a junction.
        stop: distance of the stop lines from the origin [m].
    """

    arms: Sequence[Arm]
    stop: float

    @property
    def is_junction(self) -> bool:
        """Whether there are stop lines."""
        return len(self.arms) > 2

    @property
    def surface(self) -> Polygon:
        """The drivable surface; in one piece, because all arms meet."""
        mouths = [
            arm.at(self.stop, side * arm.half_width) for arm in self.arms for side in (-1.0, 1.0)
        ]
        if not self.is_junction:
            half = max(arm.half_width for arm in self.arms)
            mouths = list(np.array(Point(0, 0).buffer(half).exterior.coords))
        middle = MultiPoint(mouths).convex_hull
        whole = shapely.union_all([middle, *(arm.surface for arm in self.arms)])
        border = shapely.get_exterior_ring(whole.simplify(0.01))  # no corners that are almost flat
        return Polygon(shapely.get_coordinates(border))

    def way(self, start: Arm, lane: int, goal: Arm, distance: float) -> Float:
        """The way of a vehicle: its lane, a curve through the junction, a lane outwards.

        Args:
            start: the arm it comes from.
            lane: of `start`.
            goal: the arm it goes to.
            distance: from the origin, where it begins, on `start` [m].

        Returns:
            Vertices [m], shape (vertex, 2).
        """
        leaving = min(lane, goal.lanes - 1)
        gate, entry = start.inbound(self.stop, lane), goal.outbound(self.stop, leaving)
        end = goal.outbound(LENGTH - 10, leaving)
        bend = _meet(gate, start.heading, entry, goal.heading)
        t = np.linspace(0, 1, 9)[:, None]  # a quadratic Bezier curve
        curve = (1 - t) ** 2 * gate + 2 * t * (1 - t) * bend + t**2 * entry
        return np.concatenate([[start.inbound(distance, lane)], curve, [end]])


def _meet(gate: Float, inwards: float, entry: Float, outwards: float) -> Float:
    """Find where the line through `gate` meets that through `entry`; the middle if far away."""
    first = np.array([np.cos(inwards), np.sin(inwards)])
    second = np.array([np.cos(outwards), np.sin(outwards)])
    sine = first[0] * second[1] - first[1] * second[0]
    offset = entry - gate
    middle: Float = (gate + entry) / 2
    if abs(sine) < 0.3:
        return middle
    along = (offset[0] * second[1] - offset[1] * second[0]) / sine
    met: Float = gate + along * first
    return met


def draw_road(rng: np.random.Generator) -> Road:
    """Draw a road: two, three or four arms, one to three lanes per direction, turned anyhow."""
    count = int(rng.choice([2, 3, 4], p=[0.25, 0.25, 0.5]))
    main, crossing = (int(n) for n in rng.integers(1, 4, 2))
    first = rng.uniform(0, 2 * np.pi)
    skew = np.radians(rng.uniform(-15, 15))
    bend = np.radians(rng.uniform(-10, 10))
    turns = [0.0, np.pi / 2 + skew, np.pi + bend, 3 * np.pi / 2 + skew]
    lanes = [main, crossing, main, crossing]
    chosen = {2: [0, 2], 3: [0, 1, 2], 4: [0, 1, 2, 3]}[count]
    arms = [Arm(first + turns[k], lanes[k]) for k in chosen]
    stop = max(arm.half_width for arm in arms) + rng.uniform(3, 7) if count > 2 else 0.0
    return Road(arms, stop)


EXTENT: Final = 80.0
"""Buildings stand within this distance of the junction [m]."""
_SMALLEST: Final = 30.0
"""Smallest footprint [m^2]; smaller rests are left out."""


def draw_buildings(rng: np.random.Generator, road: Road) -> tuple[Building, ...]:
    """Draw nothing, solid blocks or rows of houses between each two arms.

    They are set back from the road by 1.5 to 14 m. Rows are 8 to 18 m deep, follow both roads round
    the corner (and are then not convex) and have gaps. Their heights are 3 to 25 m.
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
    """Draw an alley across `arm`."""
    distance, width = rng.uniform(15, EXTENT - 5), rng.uniform(3, 15)
    across = LineString([arm.at(distance, -2 * EXTENT), arm.at(distance, 2 * EXTENT)])
    return across.buffer(width / 2, cap_style="flat")


def _land(road: Road, arm: Arm, after: Arm, setback: float) -> BaseGeometry:
    """Find the land between two arms."""
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
