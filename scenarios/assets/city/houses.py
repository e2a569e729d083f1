"""Rows of buildings along the streets of a net, none of them on a street or in another one."""

import math
from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from random import Random
from typing import Final, TypeAlias
from xml.sax.saxutils import quoteattr

from scenarios.assets.city.streets import Lane, Point, Streets

_FRONTAGE: Final = (14.0, 34.0)
_DEPTH: Final = (11.0, 17.0)
_GAP: Final = (0.5, 9.0)
_STOREYS: Final = (2, 8)
_STOREY: Final = 3.2
_ROOF: Final = 2.0
_SETBACK: Final = 2.5
"""From the edge of the street to the fronts [m]."""

_CLEARANCE: Final = 1.0
"""From the edge of every lane to every wall, at least [m]."""

_SAMPLE: Final = 1.0
"""Lanes are looked at every so many metres."""

_CELL: Final = 40.0
"""Side of the squares that lanes and buildings are sorted into [m]: longer than any building."""

Cell: TypeAlias = tuple[int, int]


@dataclass(frozen=True, slots=True, kw_only=True)
class House:
    """A building with a rectangular ground plan.

    Attributes:
        centre: [m].
        ahead: unit vector along the street.
        half: half of its frontage and half of its depth [m].
        height: [m].
    """

    centre: Point
    ahead: Point
    half: Point
    height: float

    @property
    def corners(self) -> tuple[Point, ...]:
        """Counter-clockwise [m]."""
        (x, y), (a, b), (front, deep) = self.centre, self.ahead, self.half
        signs = ((1, 1), (-1, 1), (-1, -1), (1, -1))
        return tuple(
            (x + s * front * a - t * deep * b, y + s * front * b + t * deep * a) for s, t in signs
        )

    def distance(self, point: Point) -> float:
        """From its walls to a point outside [m]; 0 inside."""
        dx, dy = point[0] - self.centre[0], point[1] - self.centre[1]
        along = abs(dx * self.ahead[0] + dy * self.ahead[1]) - self.half[0]
        across = abs(dy * self.ahead[0] - dx * self.ahead[1]) - self.half[1]
        return math.hypot(max(along, 0.0), max(across, 0.0))

    def overlaps(self, other: "House") -> bool:
        """Whether both have ground in common: no side of either separates them."""
        for one in (self, other):
            (a, b), (x, y) = one.ahead, one.centre
            for axis, half in (((a, b), one.half[0]), ((-b, a), one.half[1])):
                seen = [(p - x) * axis[0] + (q - y) * axis[1] for p, q in _other(one, self, other)]
                if min(seen) >= half or max(seen) <= -half:
                    return False
        return True


def houses(streets: Streets, rng: Random) -> list[House]:
    """Buildings along both sides of all streets.

    Args:
        streets: of the net.
        rng: says how wide, deep and high they are.
    """
    found: list[House] = []
    taken: defaultdict[Cell, list[House]] = defaultdict(list)
    paved: defaultdict[Cell, list[tuple[Point, float]]] = defaultdict(list)
    for place, margin in _points(streets.lanes):
        paved[_cell(place)].append((place, margin))
    for _, kerb in sorted(streets.kerbs.items()):
        for house in _row(kerb, rng):
            around = _around(house.centre)
            if any(house.distance(at) < margin for cell in around for at, margin in paved[cell]):
                continue
            if any(house.overlaps(each) for cell in around for each in taken[cell]):
                continue
            found.append(house)
            taken[_cell(house.centre)].append(house)
    return found


def polygons(found: Sequence[House]) -> str:
    """The text of a SUMO additional file with the buildings."""
    lines = ["<additional>"]
    for number, house in enumerate(found):
        shape = " ".join(f"{x:.1f},{y:.1f}" for x, y in house.corners)
        lines.append(
            f'<poly id="house_{number}" type="building" color="0.6,0.6,0.6" fill="1" layer="4" '
            f'shape={quoteattr(shape)}><param key="height" value="{house.height:.1f}"/></poly>'
        )
    return "\n".join([*lines, "</additional>", ""])


def _other(one: House, first: House, second: House) -> tuple[Point, ...]:
    return (second if one is first else first).corners


def _cell(point: Point) -> Cell:
    return math.floor(point[0] / _CELL), math.floor(point[1] / _CELL)


def _around(point: Point) -> list[Cell]:
    """The cells with everything that can touch a building whose centre is there."""
    x, y = _cell(point)
    return [(x + dx, y + dy) for dx in (-1, 0, 1) for dy in (-1, 0, 1)]


def _points(lanes: Sequence[Lane]) -> Iterator[tuple[Point, float]]:
    """Points of the lanes, and how far walls are from each at least [m]."""
    for lane in lanes:
        margin = 0.5 * lane.width + _CLEARANCE
        for (x, y), (p, q) in zip(lane.shape, lane.shape[1:], strict=False):
            count = math.ceil(math.dist((x, y), (p, q)) / _SAMPLE) or 1
            for k in range(count + 1):
                yield (x + k / count * (p - x), y + k / count * (q - y)), margin


def _row(kerb: Lane, rng: Random) -> Iterator[House]:
    """Buildings to the right of a lane, whatever is there already."""
    for start, end in zip(kerb.shape, kerb.shape[1:], strict=False):
        length = math.dist(start, end)
        if length == 0.0:
            continue
        ahead = ((end[0] - start[0]) / length, (end[1] - start[1]) / length)
        at = rng.uniform(*_GAP)
        while True:
            front, deep = rng.uniform(*_FRONTAGE), rng.uniform(*_DEPTH)
            height = _ROOF + _STOREY * rng.randint(*_STOREYS)
            if at + front > length:
                break
            along = at + 0.5 * front
            aside = 0.5 * kerb.width + _SETBACK + 0.5 * deep
            yield House(
                centre=(start[0] + along * ahead[0] + aside * ahead[1],
                        start[1] + along * ahead[1] - aside * ahead[0]),
                ahead=ahead,
                half=(0.5 * front, 0.5 * deep),
                height=height,
            )  # fmt: skip
            at += front + rng.uniform(*_GAP)
