"""Route files and additional files: whether what they refer to exists, and ids are unique."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Final

from typing_extensions import override

from adapters.sumo.checks.departures import Departures
from adapters.sumo.checks.findings import Findings
from adapters.sumo.checks.net import Roads
from adapters.sumo.checks.polygons import PolygonReader
from adapters.sumo.checks.reading import Attributes, Elements
from adapters.sumo.checks.roots import root_problem
from orchestrator.errors import Location

DEFAULT_TYPES: Final = frozenset(
    f"DEFAULT_{kind}TYPE" for kind in ("VEH", "PED", "BIKE", "CONTAINER", "TAXI", "RAIL")
)
"""Types that SUMO has in every scene."""

_TRIP: Final = ("from", "to", "via")
_ENDS: Final = ("from", "to")
_STOPS: Final = ("busStop", "trainStop", "containerStop", "chargingStation", "parkingArea")
_LOOPS: Final = ("inductionLoop", "e1Detector", "instantInductionLoop")
_AREAS: Final = ("laneAreaDetector", "e2Detector")

_EDGES: Final[Mapping[str, tuple[str, ...]]] = MappingProxyType(
    {
        "route": ("edges",),
        **dict.fromkeys(("vehicle", "trip", "flow"), _TRIP),
        "walk": ("edges", *_ENDS),
        **dict.fromkeys(("personTrip", "ride", "transport", "tranship"), _ENDS),
        **dict.fromkeys(("stop", "routeProbe", "calibrator"), ("edge",)),
        **dict.fromkeys(("rerouter", "taz"), ("edges",)),
        **dict.fromkeys(("tazSource", "tazSink"), ("id",)),
    }
)
"""Attributes that are edges, or lists of edges."""

_LANES: Final[Mapping[str, tuple[str, ...]]] = MappingProxyType(
    {
        **dict.fromkeys((*_STOPS, *_LOOPS, "stop", "calibrator", "detEntry", "detExit"), ("lane",)),
        **dict.fromkeys(_AREAS, ("lane", "lanes")),
        "variableSpeedSign": ("lanes",),
    }
)
"""Attributes that are lanes, or lists of lanes."""

_TRAFFIC: Final = frozenset(
    {"vehicle", "trip", "flow", "person", "personFlow", "container", "containerFlow"}
)
_LOADS: Final = frozenset({"container", "containerFlow"})
DISTRIBUTION: Final = "vTypeDistribution"
_TYPES: Final = frozenset({"vType", DISTRIBUTION})
_ROUTES: Final = frozenset({"route", "routeDistribution"})

_ONE_OF: Final[Mapping[str, str]] = MappingProxyType(
    {
        **dict.fromkeys(_TYPES, "vehicle type"),
        **dict.fromkeys(_ROUTES, "route"),
        **dict.fromkeys(("vehicle", "trip"), "vehicle"),
        **dict.fromkeys(("flow", "person", "personFlow", "container", "containerFlow"), ""),
        **dict.fromkeys((*_STOPS, *_LOOPS, *_AREAS, "rerouter", "taz", "calibrator", "poi"), ""),
        **dict.fromkeys(("variableSpeedSign", "edgeData", "laneData"), ""),
        "poly": "polygon",
    }
)
"""Elements whose ids are unique, and what shares them; empty for the element alone."""


@dataclass(slots=True)
class Scene:
    """What the files of a scene declare and refer to, as far as they have been read.

    Attributes:
        roads: of the net; edges and lanes are looked up if it is complete.
        polygons: reads the polygons.
        traffic: how many vehicles, trips, flows, persons and containers are declared.
        loads: how many of them are containers, and where the first one is.
    """

    findings: Findings
    roads: Roads
    polygons: PolygonReader
    traffic: int = 0
    loads: tuple[int, Location] | None = None
    types: set[str] = field(default_factory=lambda: set(DEFAULT_TYPES))
    distributions: set[str] = field(default_factory=set)
    routes: set[str] = field(default_factory=set)
    ids: dict[tuple[str, str], Location] = field(default_factory=dict)
    wanted_types: list[tuple[str, str, Location]] = field(default_factory=list)
    wanted_routes: list[tuple[str, str, Location]] = field(default_factory=list)

    def finish(self) -> None:
        """All files have been read to their ends: what nobody has declared, what is left out."""
        if self.loads is not None:
            count, where = self.loads
            noun = "container is" if count == 1 else "containers or flows of them are"
            self.findings.remark(where, f"{count} {noun} left out: loads are no road users")
        for name, user, where in self.wanted_types:
            if name not in self.types:
                what = (
                    f"{user}: no file of the scene declares the type `{name}`; add "
                    f'`<vType id="{name}" vClass="..."/>`, or use `DEFAULT_VEHTYPE`'
                )
                self.findings.add("types that nobody declares", where, what)
        for name, user, where in self.wanted_routes:
            if name not in self.routes:
                what = f"{user}: no file of the scene declares the route `{name}`"
                self.findings.add("routes that nobody declares", where, what)


class DemandElements(Elements):
    """Reads a route file or an additional file.

    Args:
        scene: what has been read so far.
        wanted: `routes` or `additional`.
        departures: look at their order; `None` if it does not matter.
    """

    def __init__(self, scene: Scene, wanted: str, departures: Departures | None = None) -> None:
        super().__init__()
        self._scene = scene
        self._wanted = wanted
        self._departures = departures

    @override
    def root(self, name: str, attributes: Attributes) -> bool:
        what = root_problem(name, self._wanted)
        if what is not None:
            self._scene.findings.add("wrong roots", self._here(), what)
        return what is None

    @override
    def start(self, name: str, attributes: Attributes) -> None:
        self._scene.polygons.start(name, attributes, self._here)
        user = f"{name} `{attributes['id']}`" if "id" in attributes else name
        self._declare(name, user, attributes)
        self._refer(name, user, attributes)
        if self._departures is not None:
            self._departures.note(name, user, attributes, self._here())
        if self._scene.roads.complete:
            roads = self._scene.roads
            self._look_up("edge", roads.edges, _EDGES.get(name, ()), user, attributes)
            self._look_up("lane", roads.lanes, _LANES.get(name, ()), user, attributes)

    @override
    def end(self, name: str) -> None:
        self._scene.polygons.end(name)

    def _declare(self, name: str, user: str, attributes: Attributes) -> None:
        scene = self._scene
        scene.traffic += name in _TRAFFIC
        if name in _LOADS:
            count, first = scene.loads or (0, self._here())
            scene.loads = (count + 1, first)
        if name not in _ONE_OF or "id" not in attributes:
            return
        if name in _TYPES:
            scene.types.add(attributes["id"])
            if name == DISTRIBUTION:
                scene.distributions.add(attributes["id"])
        elif name in _ROUTES:
            scene.routes.add(attributes["id"])
        key = (_ONE_OF[name] or name, attributes["id"])
        where = self._here()
        if first := scene.ids.get(key):
            place = f"line {first.line}" if first.file == where.file else str(first)
            scene.findings.add("ids used twice", where, f"{user} is declared in {place} already")
        else:
            scene.ids[key] = where

    def _refer(self, name: str, user: str, attributes: Attributes) -> None:
        scene = self._scene
        if name in _TRAFFIC and (kind := attributes.get("type", "")) not in scene.types and kind:
            scene.wanted_types.append((kind, user, self._here()))
        if name == DISTRIBUTION:
            members = attributes.get("vTypes", "").split()
            scene.wanted_types += [(member, user, self._here()) for member in members]
        if name in {"vehicle", "flow"} and "route" in attributes:
            scene.wanted_routes.append((attributes["route"], user, self._here()))
        if name == "routeDistribution":
            members = attributes.get("routes", "").split()
            scene.wanted_routes += [(member, user, self._here()) for member in members]

    def _look_up(
        self,
        noun: str,
        known: Mapping[str, int],
        names: tuple[str, ...],
        user: str,
        attributes: Attributes,
    ) -> None:
        for attribute in names:
            missing = [each for each in attributes.get(attribute, "").split() if each not in known]
            if missing:
                what = f"{user}: `{attribute}`: the net has no {noun} `{missing[0]}`"
                more = f" (and {len(missing) - 1} more here)" if len(missing) > 1 else ""
                self._scene.findings.add(f"unknown {noun}s", self._here(), what + more)
