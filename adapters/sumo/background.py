"""Background traffic: one vehicle per `spacing` metres and lane on average.

At the start, vehicles stand in a row along every lane with exponentially distributed gaps beyond
a smallest one: a Poisson process whose points keep a distance. Afterwards vehicles enter where
lanes begin at the border of the net, at exponentially distributed intervals of `spacing`
over the speed limit, while the lane holds fewer than its length over `spacing`.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from adapters.sumo.errors import SumoError
from adapters.sumo.net import Link
from adapters.sumo.parameters import Background as Demand
from adapters.sumo.placement import OnRoad, Placed, behind
from adapters.sumo.scene import VehicleType, path_over
from adapters.sumo.simulation import Departure, Sumo
from adapters.traffic.polyline import Polyline
from orchestrator.signal import Array

_SMALLEST_GAP: Final = 4.0
"""Bumper to bumper [m] at the start; SUMO chooses the speed that is safe at this gap."""

_TALL: Final = 2.0
"""Vehicles higher than this [m] obstruct the links between the antennas of cars."""

_LONGEST_ROUTE: Final = 20_000.0
"""A drawn route ends after this way [m]; then the vehicle arrives, as at the border of the net."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class KeptClear:
    """Where no background vehicle is placed.

    Attributes:
        reserved: lanes that none starts on.
        closed: lanes that none turns into from the lane it starts on.
        limits: on some lanes, how far vehicles may be placed at the start [m].
    """

    reserved: frozenset[str]
    closed: frozenset[str]
    limits: Mapping[str, float]


def kept_clear(sumo: Sumo, placed: Sequence[Placed]) -> KeptClear:
    """What the entities on the road want to be kept clear."""
    reserved, closed = set[str](), set[str]()
    limits: dict[str, float] = {}
    for each in placed:
        if not isinstance(each.place, OnRoad):
            continue
        lane = each.place.lane
        match each.entity.keeps_clear:
            case "behind":
                limits[lane] = min(behind(each), limits.get(lane, math.inf))
            case "lane":
                reserved.add(lane)
            case "edge":
                reserved.update(sumo.net.lanes_of(sumo.net.edge_of(lane)))
                closed.update(link.to_lane for link in each.place.links[:1])
    return KeptClear(reserved=frozenset(reserved), closed=frozenset(closed), limits=limits)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Stream:
    """The background vehicles that start on one lane.

    Attributes:
        lane: its name.
        edge: its edge.
        index: of the lane on its edge, 0 is the rightmost.
        free: fronts may be placed from the start of the lane up to here [m].
        length: of the lane [m].
        speed_limit: [m/s].
        links: the ways on from here; none at the border of the net.
        enters: whether vehicles enter here during the run.
    """

    lane: str
    edge: str
    index: int
    free: float
    length: float
    speed_limit: float
    links: tuple[Link, ...]
    enters: bool


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Fork:
    """Where vehicles of one class may go from a lane.

    Attributes:
        links: the ways on that are open to the class.
        weights: probabilities of these.
        length: of the lane [m].
    """

    links: tuple[Link, ...]
    weights: tuple[float, ...]
    length: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Spawned:
    """A background vehicle on its way into the net.

    Attributes:
        path: centre line of the first part of its route, up to the lane after the junction.
    """

    name: str
    type: VehicleType
    path: Polyline
    departure: Departure


class Background:
    """Draws the background vehicles.

    Args:
        sumo: the simulation; routes are declared in it.
        types: of the scene; their `share` is their weight.
        demand: how much traffic.
        clear: where it must not be.
        rng: a stream of its own.

    Raises:
        SumoError: no vehicle type has a share, or none of those that `tall_share` asks for.
    """

    def __init__(
        self,
        sumo: Sumo,
        types: Sequence[VehicleType],
        demand: Demand,
        clear: KeptClear,
        rng: np.random.Generator,
    ) -> None:
        self._sumo, self._net = sumo, sumo.net
        self._demand = demand
        self._types = [kind for kind in types if kind.share > 0.0]
        if not self._types:
            raise SumoError(
                "no vehicle type of the scene has a positive `share`, so there is no background "
                'traffic; add `<param key="share" value="1"/>` to a `<vType>`'
            )
        self._shares = _shares(self._types, demand.tall_share)
        self._rng = rng
        self._streams = tuple(_streams(sumo, clear))
        self._next_entry = {stream.lane: self._interval(stream) for stream in self._streams}
        self._stood_in = np.zeros(len(self._types))
        self._starts: dict[tuple[str, str], Fork] = {}
        self._ways: dict[tuple[str, str], Fork] = {}
        self._routes: dict[tuple[str, ...], str] = {}
        self._paths: dict[tuple[str, str], Polyline] = {}
        self._count = 0

    def place(self) -> list[Spawned]:
        """The vehicles present at the start, of each lane from its end to its start."""
        return [spawned for stream in self._streams for spawned in self._row(stream)]

    def enter(self, elapsed: float) -> list[Spawned]:
        """The vehicles that want to enter `elapsed` [s] after the start."""
        entering = []
        for stream in self._streams:
            if not stream.enters or elapsed < self._next_entry[stream.lane]:
                continue
            self._next_entry[stream.lane] = elapsed + self._interval(stream)
            if self._sumo.occupancy(stream.lane) < stream.length / self._demand.spacing:
                kind = self._draw_type(stream)
                if kind is not None:
                    entering.append(self._spawn(stream, kind, kind.length))
        return entering

    def _row(self, stream: Stream) -> list[Spawned]:
        row: list[Spawned] = []
        front = stream.free - self._rng.uniform(0.0, self._demand.spacing)
        while True:
            kind = self._draw_type(stream)
            if kind is None or front < kind.length:
                return row
            row.append(self._spawn(stream, kind, front))
            front -= kind.length + _SMALLEST_GAP + self._rng.exponential(self._mean_extra_gap())

    def _spawn(self, stream: Stream, kind: VehicleType, front: float) -> Spawned:
        name = f"background.{self._count}"
        self._count += 1
        links = self._draw_way(stream, kind)
        edges = (stream.edge, *(self._net.edge_of(link.to_lane) for link in links))
        return Spawned(
            name=name,
            type=kind,
            path=self._path(stream, links[:1]),
            departure=Departure(
                name=name,
                type=kind.name,
                route=self._route(edges),
                lane=stream.index,
                position=front,
                speed=None,
                changes_lanes=self._demand.changes_lanes,
            ),
        )

    def _draw_way(self, stream: Stream, kind: VehicleType) -> list[Link]:
        """A way from lane to lane that ends at the border of the net, or after a long way.

        It ends before that where no way on is open to the class of `kind`.
        """
        fork = self._start(stream, kind)
        way: list[Link] = []
        length = 0.0
        if not fork.links:
            self._rng.choice(1, p=fork.weights)  # as many draws as on other lanes
        while fork.links and length < _LONGEST_ROUTE:
            link = fork.links[int(self._rng.choice(len(fork.links), p=fork.weights))]
            way.append(link)
            fork = self._onward(link.to_lane, kind)
            length += fork.length
        return way

    def _start(self, stream: Stream, kind: VehicleType) -> Fork:
        """The ways on from the lane that vehicles of `stream` start on."""
        key = (stream.lane, kind.vehicle_class)
        if key not in self._starts:
            self._starts[key] = self._fork(stream.links, stream.length, kind)
        return self._starts[key]

    def _onward(self, lane: str, kind: VehicleType) -> Fork:
        """The ways on from a `lane` beyond the first junction."""
        key = (lane, kind.vehicle_class)
        if key not in self._ways:
            net = self._net
            self._ways[key] = self._fork(net.links(lane), net.lane_length(lane), kind)
        return self._ways[key]

    def _fork(self, links: Sequence[Link], length: float, kind: VehicleType) -> Fork:
        open_ = tuple(link for link in links if self._is_open(link, kind))
        weights = _weights(open_, self._demand.turning_share)
        return Fork(links=open_, weights=weights, length=length)

    def _is_open(self, link: Link, kind: VehicleType) -> bool:
        lanes = (link.via, link.to_lane) if link.via else (link.to_lane,)
        return all(self._net.allows(lane, kind.vehicle_class) for lane in lanes)

    def _route(self, edges: tuple[str, ...]) -> str:
        """The name of a route, declared when it is first driven."""
        name = self._routes.get(edges)
        if name is None:
            name = f"background.{len(self._routes)}"
            self._routes[edges] = name
            self._sumo.add_route(name, edges)
        return name

    def _path(self, stream: Stream, links: Sequence[Link]) -> Polyline:
        key = (stream.lane, links[0].to_lane if links else "")
        found = self._paths.get(key)
        if found is None:
            found = self._paths[key] = path_over(self._net, stream.lane, links)
        return found

    def _draw_type(self, stream: Stream) -> VehicleType | None:
        """The type of the next vehicle of `stream`; `None` if no type may be there.

        For one that may not be there stands in, of those that may, the one that has stood in least
        often for its share; so the draws are the same whatever is closed.
        """
        drawn = int(self._rng.choice(len(self._types), p=self._shares))
        if self._may_start(stream, self._types[drawn]):
            return self._types[drawn]
        open_ = [k for k, kind in enumerate(self._types) if self._may_start(stream, kind)]
        open_ = [k for k in open_ if self._shares[k] > 0.0]
        if not open_:
            return None
        chosen = min(open_, key=lambda k: (self._stood_in[k] + 1.0) / self._shares[k])
        self._stood_in[chosen] += 1.0
        return self._types[chosen]

    def _may_start(self, stream: Stream, kind: VehicleType) -> bool:
        """Whether the class of `kind` may use the lane, and a way on from it if there is any."""
        is_open = self._net.allows(stream.lane, kind.vehicle_class)
        return is_open and (not stream.links or bool(self._start(stream, kind).links))

    def _mean_extra_gap(self) -> float:
        length = float(self._shares @ [kind.length for kind in self._types])
        return max(self._demand.spacing - length - _SMALLEST_GAP, 0.0)

    def _interval(self, stream: Stream) -> float:
        return float(self._rng.exponential(self._demand.spacing / stream.speed_limit))


def _shares(types: Sequence[VehicleType], tall: float | None) -> Array:
    """The share of each type, float64, shape (type,); `tall` is that of the high ones together."""
    shares = np.array([kind.share for kind in types])
    if tall is None:
        return np.asarray(shares / shares.sum())
    is_tall = np.array([kind.size[2] > _TALL for kind in types])
    for wanted, rows, what in ((tall, is_tall, "is"), (1.0 - tall, ~is_tall, "is not")):
        if wanted > 0.0 and not rows.any():
            raise SumoError(
                f"`background.tall_share` is {tall:g}, but no vehicle type with a `share` {what} "
                f"higher than {_TALL:g} m; declare one in the scene"
            )
        shares[rows] *= wanted / (shares[rows].sum() or 1.0)
    return shares


def _streams(sumo: Sumo, clear: KeptClear) -> Iterator[Stream]:
    """Where background vehicles start: on all lanes of passenger cars that are not kept clear."""
    lanes = [lane for lane in sumo.net.lanes() if sumo.net.allows(lane, "passenger")]
    exits = {lane: sumo.net.links(lane) for lane in lanes}
    entered = {link.to_lane for links in exits.values() for link in links}
    for lane in lanes:
        links = [link for link in exits[lane] if link.to_lane not in clear.closed]
        if lane in clear.reserved or (exits[lane] and not links):
            continue
        length = sumo.net.lane_length(lane)
        yield Stream(
            lane=lane,
            edge=sumo.net.edge_of(lane),
            index=sumo.net.index_of(lane),
            free=min(clear.limits.get(lane, length), length),
            length=length,
            speed_limit=sumo.net.speed_limit(lane),
            links=tuple(links),
            enters=bool(exits[lane]) and lane not in entered,
        )


def _weights(links: Sequence[Link], turning_share: float) -> tuple[float, ...]:
    """Probabilities of the ways a lane leads to; of one, if it is the end of the net."""
    straight = sum(link.direction == "s" for link in links)
    turning = len(links) - straight
    if not straight or not turning:
        count = max(len(links), 1)
        return (1.0 / count,) * count
    share = {True: (1.0 - turning_share) / straight, False: turning_share / turning}
    return tuple(share[link.direction == "s"] for link in links)
