"""A SUMO net: which edges and lanes it has, and whether it holds together."""

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Final

from typing_extensions import override

from adapters.sumo.checks.findings import Findings
from adapters.sumo.checks.reading import Attributes, Elements
from adapters.sumo.checks.roots import root_problem
from adapters.traffic.remarks import flat
from orchestrator.errors import Location

FAR: Final = 1e5
"""Coordinates beyond this [m] are counted from the corner of the net."""


_NONE: Final = "!"
"""What netconvert writes as the projection of a net that has none."""


@dataclass(slots=True)
class Roads:
    """The roads of a net.

    Attributes:
        edges, lanes: the line of each, by id; inner ones of junctions too.
        has_projection: whether degrees can be turned into positions.
        complete: whether the net could be read to its end.
    """

    edges: dict[str, int] = field(default_factory=dict)
    lanes: dict[str, int] = field(default_factory=dict)
    has_projection: bool = False
    complete: bool = False


@dataclass(slots=True)
class _Heights:
    """The heights of a net's lanes.

    Attributes:
        low, high: the least and the greatest [m].
        where: the first lane that says one.
    """

    low: float = math.inf
    high: float = -math.inf
    where: Location | None = None

    def take(self, shape: str, here: Callable[[], Location]) -> None:
        """Look at a lane; a point without a height is at 0 m, as netconvert writes it."""
        if shape.count(",") <= shape.count(" ") + 1:  # no point says one: many large nets
            self.low, self.high = min(self.low, 0.0), max(self.high, 0.0)
            return
        self.where = self.where or here()
        for point in shape.split():
            try:
                height = float(point.split(",")[2]) if point.count(",") > 1 else 0.0
            except ValueError:  # SUMO says what is wrong with it
                continue
            self.low, self.high = min(self.low, height), max(self.high, height)


class NetElements(Elements):
    """Reads a net and finds what is wrong with it.

    Args:
        findings: where problems go.
        roads: where edges and lanes go.
    """

    def __init__(self, findings: Findings, roads: Roads) -> None:
        super().__init__()
        self.roads = roads
        self._findings = findings
        self._junctions: dict[str, int] = {}
        self._ends: list[tuple[str, str, str, Location]] = []
        self._top: Location | None = None
        self._heights = _Heights()
        self._readers = {
            "edge": self._edge,
            "lane": self._lane,
            "junction": self._junction,
            "connection": self._connection,
            "location": self._location,
        }

    @override
    def root(self, name: str, attributes: Attributes) -> bool:
        if what := root_problem(name, "net"):
            self._findings.add("wrong roots", self._here(), what)
            return False
        self._top = self._here()
        if "version" not in attributes:
            what = "the net has no `version`; SUMO reads nets that netconvert has written"
            self._findings.add("nets without version", self._top, what)
        return True

    @override
    def start(self, name: str, attributes: Attributes) -> None:
        reader = self._readers.get(name)
        if reader is not None:
            reader(attributes)

    def finish(self) -> None:
        """The net has been read to its end: what can be told only now."""
        if self._top is None:
            return
        self.roads.complete = True
        if not self.roads.lanes:
            what = "the net has no lanes; it may be a template, or all its edges were removed"
            self._findings.add("nets without lanes", self._top, what)
        for junction, attribute, edge, where in self._ends:
            if junction not in self._junctions:
                what = f"edge `{edge}`: `{attribute}` is junction `{junction}`, which is not here"
                self._findings.add("ends without a junction", where, what)
        if self._heights.where is not None and self._heights.low < self._heights.high:
            what = flat(self._heights.low, self._heights.high)
            self._findings.remark(self._heights.where, what)

    def _edge(self, attributes: Attributes) -> None:
        name = attributes.get("id", "")
        self._declare("edge", name, self.roads.edges)
        for attribute in ("from", "to"):
            junction = attributes.get(attribute)
            if junction is not None and junction not in self._junctions:
                self._ends.append((junction, attribute, name, self._here()))

    def _lane(self, attributes: Attributes) -> None:
        self._declare("lane", attributes.get("id", ""), self.roads.lanes)
        self._heights.take(attributes.get("shape", ""), self._here)

    def _junction(self, attributes: Attributes) -> None:
        self._declare("junction", attributes.get("id", ""), self._junctions)

    def _connection(self, attributes: Attributes) -> None:
        for attribute in ("from", "to"):
            edge = attributes.get(attribute, "")
            if edge not in self.roads.edges:
                what = f"connection: `{attribute}` is edge `{edge}`, which is not before it"
                self._findings.add("connections of unknown edges", self._here(), what)

    def _location(self, attributes: Attributes) -> None:
        self.roads.has_projection = attributes.get("projParameter", _NONE) != _NONE
        text = attributes.get("convBoundary", "")
        try:
            numbers = [float(part) for part in text.split(",")]
        except ValueError:
            numbers = [math.nan]
        where = self._here()
        if not all(map(math.isfinite, numbers)):
            what = f"`convBoundary` is four numbers, got `{text}`"
            self._findings.add("boundaries that are none", where, what)
        elif far := [number for number in numbers if abs(number) > FAR]:
            self._findings.remark(where, far_away(far[0]))

    def _declare(self, kind: str, name: str, known: dict[str, int]) -> None:
        where = self._here()
        if name in known:
            what = f"{kind} `{name}` is declared in line {known[name]} already"
            self._findings.add(f"{kind}s declared twice", where, what)
        else:
            known[name] = where.line


def far_away(coordinate: float) -> str:
    """What to say of a coordinate [m] beyond `FAR`."""
    return (
        f"the coordinate {coordinate:.0f} m is far from the origin: all positions of the run are "
        "relative to the corner of the net, or to the parameter `origin`"
    )
