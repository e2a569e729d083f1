"""Background traffic: one vehicle per `spacing` metres and lane on average.

At the start, vehicles stand in a row along every lane with exponentially distributed gaps beyond
a smallest one: a Poisson process whose points keep a distance. Afterwards vehicles enter where
lanes begin at the border of the net, at exponentially distributed intervals of `spacing`
over the speed limit, while the lane holds fewer than its length over `spacing`.
"""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from adapters.sumo.fleet import Vehicle
from adapters.sumo.scene import VehicleType, path_over
from adapters.sumo.simulation import Departure, Link, Sumo
from adapters.traffic.polyline import Polyline

_SMALLEST_GAP: Final = 4.0
"""Bumper to bumper [m] at the start; SUMO chooses the speed that is safe at this gap."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Demand:
    """How much traffic, and what it is.

    Attributes:
        spacing: one vehicle per this many metres and lane [m].
        turning_share: of the vehicles on a lane that can also turn, those that do.
        equipped_share: of the vehicles, those with a radio.
        lidar_share: of the vehicles, those with a lidar.
        lidar_limit: largest number of background lidars.
    """

    spacing: float
    turning_share: float
    equipped_share: float
    lidar_share: float
    lidar_limit: int


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Route:
    """A route that is declared in SUMO.

    Attributes:
        path: its centre line.
    """

    name: str
    path: Polyline


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Stream:
    """The background vehicles that start on one lane.

    Attributes:
        lane: its name.
        index: of the lane on its edge, 0 is the rightmost.
        free: fronts may be placed from the start of the lane up to here [m].
        length: of the lane [m].
        speed_limit: [m/s].
        routes: the routes they take.
        weights: probabilities of the routes.
        enters: whether vehicles enter here during the run.
    """

    lane: str
    index: int
    free: float
    length: float
    speed_limit: float
    routes: tuple[Route, ...]
    weights: tuple[float, ...]
    enters: bool


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Spawned:
    """A background vehicle on its way into the net."""

    vehicle: Vehicle
    route: Route
    departure: Departure


def background_streams(
    sumo: Sumo,
    *,
    reserved: Collection[str],
    closed: Collection[str],
    limits: Mapping[str, float],
    turning_share: float,
) -> list[Stream]:
    """Declare the routes of the background traffic and say where it starts.

    Args:
        sumo: the simulation; routes are declared in it.
        reserved: lanes that no background vehicle starts on.
        closed: lanes that no background vehicle turns into.
        limits: for some lanes, the farthest position of a front at the start [m].
        turning_share: see `Demand`.
    """
    lanes = sumo.lanes()
    exits = {lane: sumo.links(lane) for lane in lanes}
    entered = {link.to_lane for links in exits.values() for link in links}
    streams = []
    for lane in lanes:
        links = [link for link in exits[lane] if link.to_lane not in closed]
        if lane in reserved or (exits[lane] and not links):
            continue
        length = sumo.lane_length(lane)
        streams.append(
            Stream(
                lane=lane,
                index=sumo.index_of(lane),
                free=min(limits.get(lane, length), length),
                length=length,
                speed_limit=sumo.speed_limit(lane),
                routes=_declare_routes(sumo, lane, links),
                weights=_weights(links, turning_share),
                enters=bool(exits[lane]) and lane not in entered,
            )
        )
    return streams


class Background:
    """Draws the background vehicles."""

    def __init__(
        self,
        streams: Sequence[Stream],
        types: Mapping[str, VehicleType],
        demand: Demand,
        rng: np.random.Generator,
    ) -> None:
        self._streams = tuple(streams)
        self._demand = demand
        self._types = [kind for kind in types.values() if kind.share > 0.0]
        shares = np.array([kind.share for kind in self._types])
        self._shares = shares / shares.sum()
        # Equipment has a stream of its own: another share of radios leaves the traffic as it is.
        self._rng = np.random.default_rng(rng.integers(2**63))
        self._equipment = np.random.default_rng(rng.integers(2**63))
        self._next_entry = {stream.lane: self._interval(stream) for stream in streams}
        self._count = 0
        self._lidars = 0

    def place(self) -> list[Spawned]:
        """The vehicles present at the start, of each lane from its end to its start."""
        return [spawned for stream in self._streams for spawned in self._row(stream)]

    def enter(self, elapsed: float, occupancy: Callable[[str], int]) -> list[Spawned]:
        """The vehicles that want to enter now.

        Args:
            elapsed: time since the start [s].
            occupancy: the number of vehicles on a lane.
        """
        entering = []
        for stream in self._streams:
            if not stream.enters or elapsed < self._next_entry[stream.lane]:
                continue
            self._next_entry[stream.lane] = elapsed + self._interval(stream)
            if occupancy(stream.lane) < stream.length / self._demand.spacing:
                kind = self._draw_type()
                entering.append(self._spawn(stream, kind, kind.length))
        return entering

    def forget(self, vehicle: Vehicle) -> None:
        """A vehicle left, or found no room: its lidar may be given to another."""
        self._lidars -= vehicle.lidar

    def _row(self, stream: Stream) -> list[Spawned]:
        row: list[Spawned] = []
        front = stream.free - self._rng.uniform(0.0, self._demand.spacing)
        while True:
            kind = self._draw_type()
            if front < kind.length:
                return row
            row.append(self._spawn(stream, kind, front))
            front -= kind.length + _SMALLEST_GAP + self._rng.exponential(self._mean_extra_gap())

    def _spawn(self, stream: Stream, kind: VehicleType, front: float) -> Spawned:
        name = f"background.{self._count}"
        self._count += 1
        route = stream.routes[int(self._rng.choice(len(stream.routes), p=stream.weights))]
        has_radio, has_lidar = self._equipment.random(2) < (
            self._demand.equipped_share,
            self._demand.lidar_share,
        )
        has_lidar &= self._lidars < self._demand.lidar_limit
        self._lidars += int(has_lidar)
        return Spawned(
            vehicle=Vehicle(name=name, type=kind, equipped=bool(has_radio), lidar=bool(has_lidar)),
            route=route,
            departure=Departure(
                name=name,
                type=kind.name,
                route=route.name,
                lane=stream.index,
                position=front,
                speed=None,
            ),
        )

    def _draw_type(self) -> VehicleType:
        return self._types[int(self._rng.choice(len(self._types), p=self._shares))]

    def _mean_extra_gap(self) -> float:
        length = float(self._shares @ [kind.length for kind in self._types])
        return max(self._demand.spacing - length - _SMALLEST_GAP, 0.0)

    def _interval(self, stream: Stream) -> float:
        return float(self._rng.exponential(self._demand.spacing / stream.speed_limit))


def _declare_routes(sumo: Sumo, lane: str, links: Sequence[Link]) -> tuple[Route, ...]:
    """One route per way that `lane` leads, or the lane alone if it leads out of the net."""
    edge = sumo.edge_of(lane)
    if not links:
        sumo.add_route(lane, [edge])
        return (Route(name=lane, path=Polyline(sumo.lane_shape(lane))),)
    routes = []
    for link in links:
        name = f"{lane}>{link.to_lane}"
        sumo.add_route(name, [edge, sumo.edge_of(link.to_lane)])
        routes.append(Route(name=name, path=path_over(sumo, lane, link)))
    return tuple(routes)


def _weights(links: Sequence[Link], turning_share: float) -> tuple[float, ...]:
    """Probabilities of the ways a lane leads to; of one, if it is the end of the net."""
    straight = sum(link.direction == "s" for link in links)
    turning = len(links) - straight
    if not straight or not turning:
        count = max(len(links), 1)
        return (1.0 / count,) * count
    share = {True: (1.0 - turning_share) / straight, False: turning_share / turning}
    return tuple(share[link.direction == "s"] for link in links)
