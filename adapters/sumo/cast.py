"""The basic vehicles: ego, collision vehicle, lidar sharing node and blocking vehicles."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from adapters.sumo.fleet import Part, Vehicle
from adapters.sumo.parameters import TrafficParameters
from adapters.sumo.scene import VehicleType, path_over, straight_on
from adapters.sumo.simulation import Departure, Sumo, SumoError
from adapters.traffic.geometry import Float
from adapters.traffic.polyline import Polyline

EGO: Final = "ego"
COLLIDER: Final = "collider"
SHARER: Final = "sharer"
BLOCKING: Final = "blocking"

_FREE_ROAD: Final = 10.0
"""Road behind the ego vehicle and the sharing node that is kept free at the start [m]."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Role:
    """A basic vehicle at the start.

    Attributes:
        path: centre line of its route.
        next_lane: the lane it takes beyond the junction.
    """

    vehicle: Vehicle
    departure: Departure
    path: Polyline
    next_lane: str


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Cast:
    """All basic vehicles.

    Attributes:
        ego: the ego vehicle.
        collider: the collision vehicle.
        encounter: whether the collision vehicle takes part.
        standing: the sharing node and the blocking vehicles.
        conflict: where the paths of ego and collision vehicle cross [m], shape (2,).
        reserved: lanes that no background vehicle starts on.
        closed: lanes that no background vehicle turns into.
        limits: on some lanes, how far background vehicles may be placed at the start [m].
    """

    ego: Role
    collider: Role
    encounter: bool
    standing: tuple[Role, ...]
    conflict: Float
    reserved: frozenset[str]
    closed: frozenset[str]
    limits: Mapping[str, float]

    @property
    def everybody(self) -> tuple[Role, ...]:
        """All basic vehicles that take part, in the order of their numbers."""
        moving = (self.ego, self.collider) if self.encounter else (self.ego,)
        return moving + self.standing


def assemble(
    sumo: Sumo,
    types: Mapping[str, VehicleType],
    parameters: TrafficParameters,
    collider_speed: float,
) -> Cast:
    """Place the basic vehicles as `parameters` say.

    Args:
        sumo: the simulation; routes are declared in it.
        types: vehicle types of the scene.
        parameters: of the component.
        collider_speed: of the collision vehicle at the start [m/s].

    Raises:
        SumoError: a lane or a type does not exist, or somebody does not fit in.
    """
    casting = _Casting(sumo, types, parameters)
    ego = casting.ego()
    collider, conflict = casting.collider(ego, collider_speed)
    sharer = casting.sharer()
    approach = casting.lanes_beside(parameters.collider_lane)
    encounter = parameters.encounter
    return Cast(
        ego=ego,
        collider=collider,
        encounter=encounter,
        standing=(sharer, *casting.blocking()),
        conflict=conflict,
        reserved=frozenset({parameters.blocking_lane, *(approach if encounter else ())}),
        closed=frozenset((collider.next_lane,) if encounter else ()),
        limits={
            parameters.ego_lane: _behind(ego),
            parameters.sharer_lane: _behind(sharer),
        },
    )


def _behind(role: Role) -> float:
    return role.departure.position - role.vehicle.type.length - _FREE_ROAD


class _Casting:
    """What placing each of them needs."""

    def __init__(
        self, sumo: Sumo, types: Mapping[str, VehicleType], parameters: TrafficParameters
    ) -> None:
        self._sumo = sumo
        self._types = types
        self._parameters = parameters

    def ego(self) -> Role:
        """The ego vehicle on its lane, `ego_start` before the stop line."""
        wanted = self._parameters
        lane = self._lane(wanted.ego_lane, "ego_lane")
        kind = self._type(wanted.ego_type, "ego_type")
        room = self._sumo.lane_length(lane) - kind.length
        if wanted.ego_start > room:
            raise SumoError(
                f"`ego_start` is {wanted.ego_start:g} m, but before the stop line of `{lane}` "
                f"there is room for at most {room:.1f} m"
            )
        vehicle = Vehicle(name=EGO, type=kind, equipped=True, lidar=True, part=Part.EGO)
        front = self._sumo.lane_length(lane) - wanted.ego_start
        return self._role(vehicle, lane, front, wanted.ego_speed)

    def collider(self, ego: Role, speed: float) -> tuple[Role, Float]:
        """The collision vehicle, and the conflict point [m], shape (2,).

        It starts as far from that point, in time, as the ego vehicle.
        """
        wanted = self._parameters
        lane = self._lane(wanted.collider_lane, "collider_lane")
        kind = self._type(wanted.collider_type, "collider_type")
        vehicle = Vehicle(
            name=COLLIDER, type=kind, equipped=False, lidar=False, part=Part.COLLISION
        )
        path = path_over(self._sumo, lane, straight_on(self._sumo, lane))
        conflict = ego.path.crossing(path)
        if conflict is None:
            raise SumoError(
                f"the way straight on from `{wanted.ego_lane}` does not cross that from `{lane}`; "
                "set `ego_lane` and `collider_lane` to lanes whose ways cross"
            )
        ego_center = ego.departure.position - 0.5 * ego.vehicle.type.length
        time = (ego.path.station(*conflict) - ego_center) / wanted.ego_speed
        front = path.station(*conflict) - time * speed + 0.5 * kind.length
        return self._role(vehicle, lane, max(front, kind.length), speed), conflict

    def sharer(self) -> Role:
        """The sharing node, the first vehicle at its stop line."""
        wanted = self._parameters
        lane = self._lane(wanted.sharer_lane, "sharer_lane")
        kind = self._type(wanted.sharer_type, "sharer_type")
        vehicle = Vehicle(name=SHARER, type=kind, equipped=True, lidar=True, part=Part.SHARING)
        return self._role(vehicle, lane, self._sumo.lane_length(lane) - kind.stop_gap, 0.0)

    def blocking(self) -> list[Role]:
        """The blocking vehicles, from the stop line back."""
        wanted = self._parameters
        lane = self._lane(wanted.blocking_lane, "blocking_lane")
        kind = self._type(wanted.blocking_type, "blocking_type")
        pitch = kind.length + wanted.blocking_gap
        first = self._sumo.lane_length(lane) - kind.stop_gap
        fit = int((first - kind.length) // pitch) + 1
        if wanted.blocking_count > fit:
            raise SumoError(
                f"`blocking_count` is {wanted.blocking_count}, but lane `{lane}` has room for {fit}"
            )
        return [
            self._role(
                Vehicle(
                    name=f"{BLOCKING}.{k}",
                    type=kind,
                    equipped=wanted.blocking_equipped,
                    lidar=False,
                    part=Part.BLOCKING,
                ),
                lane,
                first - k * pitch,
                0.0,
            )
            for k in range(wanted.blocking_count)
        ]

    def lanes_beside(self, lane: str) -> list[str]:
        """All lanes of the edge that `lane` belongs to."""
        edge = self._sumo.edge_of(lane)
        return [other for other in self._sumo.lanes() if self._sumo.edge_of(other) == edge]

    def _role(self, vehicle: Vehicle, lane: str, front: float, speed: float) -> Role:
        link = straight_on(self._sumo, lane)
        self._sumo.add_route(
            vehicle.name, [self._sumo.edge_of(lane), self._sumo.edge_of(link.to_lane)]
        )
        departure = Departure(
            name=vehicle.name,
            type=vehicle.type.name,
            route=vehicle.name,
            lane=self._sumo.index_of(lane),
            position=front,
            speed=min(speed, self._sumo.speed_limit(lane)),  # SUMO refuses to insert faster ones
        )
        path = path_over(self._sumo, lane, link)
        return Role(vehicle=vehicle, departure=departure, path=path, next_lane=link.to_lane)

    def _lane(self, lane: str, parameter: str) -> str:
        if lane not in self._sumo.lanes():
            lanes = ", ".join(self._sumo.lanes())
            raise SumoError(f"`{parameter}`: the scene has no lane `{lane}`; there are {lanes}")
        return lane

    def _type(self, name: str, parameter: str) -> VehicleType:
        if name not in self._types:
            names = ", ".join(self._types)
            raise SumoError(f"`{parameter}`: the scene has no type `{name}`; there are {names}")
        return self._types[name]
