"""Polygons: which are buildings, and whether these have a ground plan and a height."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from adapters.sumo.checks.findings import Findings
from adapters.sumo.checks.net import Roads
from adapters.sumo.checks.reading import Attributes
from adapters.traffic.remarks import no_buildings, no_heights
from adapters.traffic.surroundings import SAME_POINT, THIN
from orchestrator.errors import Location

BUILDING: Final = "building"
_HEIGHT: Final = "height"
SHAPES: Final = "buildings without a ground plan"
HEIGHTS: Final = "heights"
"""Kinds of problems with buildings that end no run: scenes made from maps have some."""


def is_building(kind: str) -> bool:
    """Whether polygons of a type are buildings: `building`, or of a kind as in `building.yes`."""
    return kind == BUILDING or kind.startswith(BUILDING + ".")


@dataclass(slots=True)
class _Polygon:
    """A building that is being read.

    Attributes:
        height: what its parameter says; `None` without one.
        near_miss: what may be meant as one.
    """

    name: str
    where: Location
    height: str | None = None
    near_miss: str = ""


class PolygonReader:
    """Reads the polygons of a scene, element by element.

    Args:
        findings: where problems go.
        roads: of the net, which SUMO reads first.
        default_height: of buildings that say none [m].
    """

    def __init__(self, findings: Findings, roads: Roads, default_height: float) -> None:
        self._findings = findings
        self._roads = roads
        self._default_height = default_height
        self._count = 0
        self._silent: list[_Polygon] = []
        self._building: _Polygon | None = None
        self._others: dict[str, tuple[int, Location]] = {}

    def start(self, name: str, attributes: Attributes, here: Callable[[], Location]) -> None:
        """An element begins."""
        if name == "poly":
            self._begin(attributes, here())
        elif name == "param" and self._building is not None:
            key = attributes.get("key", "")
            if key == _HEIGHT:
                self._building.height = attributes.get("value", "")
            elif _HEIGHT in key.lower():
                self._building.near_miss = f"the parameter `{key}`"

    def end(self, name: str) -> None:
        """An element ends."""
        if name == "poly" and self._building is not None:
            self._count += 1
            if self._building.height is None:
                self._silent.append(self._building)
            else:
                self._check_height(self._building, self._building.height)
            self._building = None

    def finish(self) -> None:
        """All files have been read: how many polygons are no buildings, or say no height."""
        for kind, (count, where) in self._others.items():
            self._findings.remark(where, no_buildings(count, kind))
        if self._silent:
            self._findings.remark(self._silent[0].where, self._silence())

    def _silence(self) -> str:
        """What is said of buildings without a height."""
        near = next((each for each in self._silent if each.near_miss), None)
        hint = (
            ""
            if near is None
            else f"; building `{near.name}` has {near.near_miss}, which counts for nothing: write "
            f'`<param key="{_HEIGHT}" value="..."/>` into its element'
        )
        return no_heights(len(self._silent), self._count, self._default_height) + hint

    def _begin(self, attributes: Attributes, where: Location) -> None:
        kind = attributes.get("type", "")
        if not is_building(kind):
            count, first = self._others.get(kind, (0, where))
            self._others[kind] = (count + 1, first)
            return
        close = next((each for each in attributes if _HEIGHT in each.lower()), None)
        near_miss = "" if close is None else f"the attribute `{close}`"
        self._building = _Polygon(attributes.get("id", ""), where, near_miss=near_miss)
        text = attributes.get("shape", "")
        is_geodetic = attributes.get("geo", "").lower() in {"true", "1", "yes", "on"}
        name = f"building `{self._building.name}`"
        try:
            corners = [_corner(part) for part in text.split()]
        except ValueError:
            what = f"{name}: `shape` is a list of `x,y`, got `{_shortened(text)}`"
            self._findings.add("shapes", where, what)
            return
        if is_geodetic and self._roads.complete and not self._roads.has_projection:
            what = (
                f"{name}: `geo` says degrees, which would be taken as metres: the net has no "
                "projection; write metres, or make the net with one"
            )
            self._findings.add("shapes in degrees", where, what)
            return
        missing = _missing(corners, is_geodetic=is_geodetic)
        if missing is not None:
            self._findings.add(SHAPES, where, f"{name} is left out: {missing}")
            self._building = None

    def _check_height(self, building: _Polygon, written: str) -> None:
        if height_in(written) is not None:
            return
        what = (
            f"building `{building.name}` gets the default height: a height [m] is a positive "
            f'number in `<param key="{_HEIGHT}" value="..."/>`, got `{written}`'
        )
        self._findings.add(HEIGHTS, building.where, what)


def height_in(text: str) -> float | None:
    """The height of a building [m] that a text says; `None` if it is no positive number."""
    try:
        height = float(text)
    except ValueError:
        return None
    return height if 0.0 < height < math.inf else None


def _missing(corners: list[tuple[float, float]], *, is_geodetic: bool) -> str | None:
    """What a ground plan lacks; `None` if nothing."""
    if is_geodetic:  # degrees: SUMO projects them
        return "at least 3 different corners are needed" if len(set(corners)) < 3 else None
    count = _different(corners)
    if count < 3:
        return f"at least 3 different corners are needed, there are {count}"
    if abs(_area(corners)) < THIN:
        return "its corners lie on a line, or its outline crosses itself: the area is 0 m2"
    return None


def _corner(part: str) -> tuple[float, float]:
    x, y, *_ = map(float, part.split(","))
    if not (math.isfinite(x) and math.isfinite(y)):
        raise ValueError(part)
    return x, y


def _different(corners: list[tuple[float, float]]) -> int:
    """How many corners differ from all before them; counting ends at 3."""
    found: list[tuple[float, float]] = []
    for corner in corners:
        if all(math.dist(corner, other) >= SAME_POINT for other in found):
            found.append(corner)
        if len(found) == 3:
            break
    return len(found)


def _area(corners: list[tuple[float, float]]) -> float:
    """The signed area of an outline [m2], by the shoelace formula."""
    x0, y0 = corners[0]  # differences keep the precision far from the origin
    ring = [(x - x0, y - y0) for x, y in corners]
    return 0.5 * math.fsum(
        ax * by - bx * ay for (ax, ay), (bx, by) in zip(ring, [*ring[1:], ring[0]], strict=True)
    )


def _shortened(text: str) -> str:
    return text if len(text) <= 40 else text[:37] + "..."
