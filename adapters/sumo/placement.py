"""From declarations to vehicles at their places: who starts where, and on which way."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from adapters.sumo.entities import Entity
from adapters.sumo.errors import SumoError
from adapters.sumo.net import Link
from adapters.sumo.population import Kind, Vehicle
from adapters.sumo.scene import VehicleType, VehicleTypes, links_along, path_over, straight_on
from adapters.sumo.simulation import Departure, Sumo, route_name
from adapters.traffic.bodies import Body
from adapters.traffic.geometry import Float
from adapters.traffic.polyline import Polyline

_FREE_ROAD = 10.0
"""Road behind an entity that background vehicles keep clear at the start [m]."""

_LONGEST_WAY = 20_000.0
"""A way straight on without an end is followed so far [m]: a ring has no end."""

_EVERYWHERE = "ignoring"
"""SUMO's class of vehicles that may use any lane."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class OnRoad:
    """Where a vehicle on the road starts and where it goes.

    Attributes:
        lane: that it starts on.
        links: to the lanes that it takes.
        path: centre line of its way.
        departure: for SUMO.
    """

    lane: str
    links: tuple[Link, ...]
    path: Polyline
    departure: Departure


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Anywhere:
    """Where a body starts that is moved from point to point.

    Attributes:
        center: of the body [m], shape (2,).
        heading: counter-clockwise from east [rad].
    """

    center: Float
    heading: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Placed:
    """One vehicle of an entity, or the only one, at its place.

    Attributes:
        entity: its declaration.
        called: the name of the declaration.
        vehicle: itself.
        speed: at the start [m/s].
        place: where.
    """

    entity: Entity
    called: str
    vehicle: Vehicle
    speed: float
    place: OnRoad | Anywhere

    @property
    def road(self) -> OnRoad:
        """Its place on the road, of one that is on a lane."""
        assert isinstance(self.place, OnRoad)  # noqa: S101 - see `declarations`
        return self.place


@dataclass(frozen=True, slots=True, kw_only=True)
class Meeting:
    """Where two entities meet.

    Attributes:
        point: of the ground [m], shape (2,).
        first: of the entity that is waited for: its distance along its path [m].
        second: the same of the one that adapts its speed [m].
    """

    point: Float
    first: float
    second: float


def meeting(first: Placed, second: OnRoad, at: tuple[float, float] | None) -> Meeting | None:
    """Where the way `second` meets that of `first`: at a place, or where they first cross.

    `None` if no place is given and they do not cross.
    """
    path = first.road.path
    point = path.crossing(second.path) if at is None else np.array(at)
    if point is None:
        return None
    x, y = point.tolist()
    return Meeting(point=point, first=path.station(x, y), second=second.path.station(x, y))


@dataclass(frozen=True, slots=True, kw_only=True)
class _Part:
    """An entity that takes part.

    Attributes:
        entity: its declaration.
        role: its number among the declarations, from 1.
        speed: at the start [m/s].
    """

    entity: Entity
    role: int
    speed: float

    @property
    def master(self) -> str:
        """The name of the one that it is synchronised with; empty if with nobody."""
        return "" if self.entity.synchronise is None else self.entity.synchronise.entity


class Placement:
    """Places entities, and notes what is wrong.

    Who is synchronised with another one is placed after it, whichever is declared first.

    Args:
        sumo: the simulation; routes are declared in it.
        types: vehicle types of the scene.
        rng: draws who takes part and at which speed, in the order of the declarations.
    """

    def __init__(self, sumo: Sumo, types: VehicleTypes, rng: np.random.Generator) -> None:
        self._sumo, self._net = sumo, sumo.net
        self._types = types
        self._rng = rng
        self._placed: dict[str, list[Placed]] = {}

    def place(self, entities: Mapping[str, Entity | None]) -> list[Placed]:
        """All vehicles of `entities` that take part, in the order of their declarations.

        Raises:
            SumoError: a lane, an edge or a type does not exist, or somebody does not fit in; all
                entities that are wrong are named.
        """
        parts = self._taking_part(entities)
        problems: dict[str, str] = {}
        for name in _masters_first(parts):
            master = parts[name].master
            if master in problems:
                problems[name] = ""  # its place depends on that of the other
            elif master and master not in parts:
                problems[name] = f"`synchronise.entity` is `{master}`, which does not take part"
            else:
                try:
                    self._placed[name] = list(self._all_of(name, parts[name]))
                except SumoError as error:
                    problems[name] = str(error)
        if problems:
            found = ((name, problems.get(name)) for name in parts)
            raise SumoError("\n".join(f"`entities.{name}`: {what}" for name, what in found if what))
        return [placed for name in parts for placed in self._placed[name]]

    def _taking_part(self, entities: Mapping[str, Entity | None]) -> dict[str, _Part]:
        """Who takes part and how fast, drawn in the order of the declarations."""
        parts: dict[str, _Part] = {}
        for role, (name, entity) in enumerate(entities.items(), start=1):
            if entity is None or entity.is_roadside_unit:
                continue
            is_open = 0.0 < entity.presence < 1.0
            takes_part = self._rng.random() < entity.presence if is_open else entity.presence > 0.0
            speed = entity.speed.draw(self._rng)
            if takes_part:
                parts[name] = _Part(entity=entity, role=role, speed=speed)
        return parts

    def _all_of(self, name: str, part: _Part) -> Iterator[Placed]:
        entity, speed = part.entity, part.speed
        kind = self._type(entity.type)
        antenna = entity.antenna_height
        first = self._place(name, entity, kind, speed)
        for k in range(entity.count):
            own_name = name if entity.count == 1 else f"{name}.{k}"
            vehicle = Vehicle(
                name=own_name,
                type=kind,
                equipped=entity.radio,
                lidar=entity.lidar,
                antenna_height=kind.antenna_height if antenna is None else antenna,
                role=part.role,
                kind=Kind.PERSON if kind.body is Body.PEDESTRIAN else Kind.VEHICLE,
            )
            place = self._behind(first, own_name, entity, kind, k)
            yield Placed(entity=entity, called=name, vehicle=vehicle, speed=speed, place=place)

    def _place(
        self, name: str, entity: Entity, kind: VehicleType, speed: float
    ) -> OnRoad | Anywhere:
        at = entity.position
        if at.x is not None and at.y is not None:
            return Anywhere(center=np.array([at.x, at.y]), heading=at.h)
        if kind.body is Body.PEDESTRIAN:
            raise SumoError("who walks is placed by coordinates: `position: {x: .., y: ..}`")
        lane = self._lane(at.lane, kind)
        links = self._way(lane, entity)
        path = path_over(self._net, lane, links)
        front = self._front(entity, kind, speed, lane, path)
        edges = [self._net.edge_of(lane), *(self._net.edge_of(link.to_lane) for link in links)]
        route = route_name(name)
        self._sumo.add_route(route, edges)
        return OnRoad(
            lane=lane,
            links=tuple(links),
            path=path,
            departure=Departure(
                name=name,
                type=kind.name,
                route=route,
                lane=self._net.index_of(lane),
                position=front,
                speed=min(speed, self._net.speed_limit(lane)),  # `Cast.welcome` sets a faster one
                changes_lanes=entity.changes_lanes,
                looks_ahead=not entity.ignores_lights,
            ),
        )

    def _behind(
        self, first: OnRoad | Anywhere, name: str, entity: Entity, kind: VehicleType, k: int
    ) -> OnRoad | Anywhere:
        """The place of vehicle `k` of a queue."""
        if isinstance(first, Anywhere):
            return first
        least = self._sumo.min_gap(kind.name)
        gap = least if entity.gap is None else entity.gap
        if entity.count > 1 and gap < least:
            raise SumoError(
                f"`gap` is {gap:g} m, but SUMO keeps the `minGap` of `{kind.name}`, {least:g} m; "
                "change one of them"
            )
        pitch = kind.length + gap
        front = first.departure.position
        fit = int((front - kind.length) // pitch) + 1
        if entity.count > fit:
            raise SumoError(
                f"`count` is {entity.count}, but lane `{first.lane}` has room for {fit}"
            )
        departure = replace(first.departure, name=name, position=front - k * pitch)
        return replace(first, departure=departure)

    def _front(
        self, entity: Entity, kind: VehicleType, speed: float, lane: str, path: Polyline
    ) -> float:
        """From the start of the lane to the front bumper [m]."""
        length, at = self._net.lane_length(lane), entity.position
        if at.s is not None:
            if not kind.length <= at.s <= length:
                raise SumoError(
                    f"`position.s` is {at.s:g} m, but on `{lane}` the front bumper can be between "
                    f"{kind.length:g} m and {length:.1f} m"
                )
            return at.s
        if at.to_end is not None:
            if at.to_end > length - kind.length:
                raise SumoError(
                    f"`position.to_end` is {at.to_end:g} m, but before the end of `{lane}` there "
                    f"is room for at most {length - kind.length:.1f} m"
                )
            return length - at.to_end
        if entity.synchronise is not None:
            return self._as_far_in_time(entity, kind, speed, lane, path)
        if speed > 0.0:
            raise SumoError("it moves; say where it starts by `position.s` or `.to_end`")
        return length - kind.stop_gap  # it waits at the stop line

    def _as_far_in_time(
        self, entity: Entity, kind: VehicleType, speed: float, lane: str, path: Polyline
    ) -> float:
        """Where it starts as far from the meeting, in time, as the one it is to meet."""
        assert entity.synchronise is not None  # noqa: S101 - asked by the caller
        other = self._placed[entity.synchronise.entity][0]
        at = place_of(entity.synchronise.x, entity.synchronise.y)
        draft = OnRoad(lane=lane, links=(), path=path, departure=other.road.departure)
        meets = meeting(other, draft, at)
        if meets is None:
            raise SumoError(
                f"the way from `{lane}` does not cross that of `{other.called}`; place them on "
                "lanes whose ways cross, or give the place of the meeting as `x` and `y`"
            )
        if other.speed <= 0.0:
            raise SumoError(
                f"`{other.called}` stands at the start, so nobody can start as far in time from "
                "the meeting as it; set `position.s` or `position.to_end`"
            )
        center = other.road.departure.position - 0.5 * other.vehicle.type.length
        time = (meets.first - center) / other.speed
        return max(meets.second - time * speed + 0.5 * kind.length, kind.length)

    def _way(self, lane: str, entity: Entity) -> list[Link]:
        """The links that it follows."""
        edges: Sequence[str] = entity.route
        if entity.to:
            self._edge(entity.to, "to")
            start = self._net.edge_of(lane)
            edges = self._net.way_between(start, entity.to, entity.type)[1:]
            if not edges and entity.to != start:
                raise SumoError(f"`to`: no way leads from `{start}` to `{entity.to}`")
        if edges or entity.to:
            for edge in edges:
                self._edge(edge, "route")
            return links_along(self._net, lane, edges)
        if not self._net.links(lane):
            return []
        return list(self._straight(lane))

    def _straight(self, lane: str) -> Iterator[Link]:
        """Straight on, beyond the first junction while there is one way on."""
        link, length = straight_on(self._net, lane), 0.0
        seen = {self._net.edge_of(lane)}
        while True:
            yield link
            edge = self._net.edge_of(link.to_lane)
            length += self._net.lane_length(link.to_lane)
            if edge in seen or length > _LONGEST_WAY:
                return
            seen.add(edge)
            try:
                link = straight_on(self._net, link.to_lane)
            except SumoError:
                return

    def _lane(self, lane: str, kind: VehicleType) -> str:
        if not self._net.has_lane(lane):
            raise SumoError(f"`position.lane`: {_missing('lane', lane, self._net.lanes())}")
        used_by = kind.vehicle_class
        if used_by != _EVERYWHERE and not self._net.allows(lane, used_by):
            raise SumoError(
                f"`position.lane`: `{lane}` is not for the class `{used_by}`, to which the type "
                f"`{kind.name}` belongs; it is open to "
                f"{', '.join(sorted(self._net.allowed(lane))) or 'nobody'}"
            )
        length = self._net.lane_length(lane)
        if length < kind.length:
            raise SumoError(
                f"`position.lane`: `{lane}` is {length:.1f} m long, too short for `{kind.name}`, "
                f"{kind.length:g} m"
            )
        return lane

    def _edge(self, edge: str, parameter: str) -> None:
        if not self._net.has_edge(edge):
            raise SumoError(f"`{parameter}`: {_missing('edge', edge, self._net.edges())}")

    def _type(self, name: str) -> VehicleType:
        if name not in self._types:
            names = [kind.name for kind in self._types.declared()]
            raise SumoError(f"`type`: {_missing('vehicle type', name, names)}")
        return self._types[name]


def _masters_first(parts: Mapping[str, _Part]) -> list[str]:
    """The names of `parts` in their order, but for those that others are synchronised with."""
    ordered: dict[str, None] = {}
    for name in parts:
        chain = [name]
        while (master := parts[chain[-1]].master) in parts and master not in ordered:
            chain.append(master)
        ordered |= dict.fromkeys(reversed(chain))
    return list(ordered)


def place_of(x: float | None, y: float | None) -> tuple[float, float] | None:
    """The point that two parameters say; `None` unless both do."""
    return None if x is None or y is None else (x, y)


def behind(placed: Placed) -> float:
    """How far background vehicles may be placed on its lane at the start [m]."""
    return placed.road.departure.position - placed.vehicle.type.length - _FREE_ROAD


def _missing(noun: str, name: str, known: Sequence[str]) -> str:
    shown = ", ".join(known[:40]) + (f" and {len(known) - 40} more" if len(known) > 40 else "")
    return f"the scene has no {noun} `{name}`; there are {shown or 'none'}"
