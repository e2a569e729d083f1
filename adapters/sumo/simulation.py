"""SUMO in this process: vehicles, persons, lights and polygons, as arrays.

`connection` says how SUMO is reached; its modules are called here and nowhere else. Positions of
vehicles are those of the middle of their front bumpers, angles clockwise from north in degrees.
"""

import math
from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from typing import Final

import numpy as np

from adapters.sumo.connection import Connection
from adapters.sumo.errors import SumoError
from adapters.sumo.net import Net
from adapters.traffic.geometry import Float

_ALL_CHECKS_OFF: Final = 0
"""Speed mode: right of way, lights, other vehicles and bounds of acceleration are ignored."""

_NO_LANE_CHANGES: Final = 0
"""Lane-change mode: none, for whatever reason."""

_KEEP_ROUTE: Final = 1
"""`moveToXY` maps the vehicle to its route only, never to the nearest other lane."""

_EXACTLY_THERE: Final = 2
"""`moveToXY` keeps the place that is asked for, on any lane or on none."""

_MATCH_RADIUS: Final = 1000.0
"""How far from its route [m] a moved vehicle may be; SUMO shows it on the nearest lane."""

_RELEASE: Final = -1.0
"""`setSpeed` with this value hands the speed back to the car-following model."""

_STOP_GAP: Final = 1.0
"""The gap of types without `jmStoplineGap` [m], SUMO's default."""

_PARKED: Final = 1
"""Flag of a stop beside the road."""

_FOR_EVER: Final = 1e9
"""Duration of a stop [s] that no run outlasts."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Departure:
    """A vehicle to be inserted at the end of the next step.

    Attributes:
        position: of the front bumper, from the start of the lane [m].
        speed: with which SUMO inserts it [m/s]; `None` for the highest that is safe.
        changes_lanes: whether SUMO may let it change lanes.
        looks_ahead: whether it enters only if it could stop for what is beyond its edge: a light,
            a junction where it yields, another vehicle. If not, `set_out` it once it is there.
    """

    name: str
    type: str
    route: str
    lane: int
    position: float
    speed: float | None
    changes_lanes: bool = False
    looks_ahead: bool = True


class Sumo:
    """The SUMO simulation of a run.

    All positions here, in and out, are relative to the origin of `net`.

    Args:
        connection: to SUMO, just opened.
        origin: as of `Net`.

    Attributes:
        net: the roads.
    """

    def __init__(self, connection: Connection, origin: tuple[float, float] | None = None) -> None:
        self._connection = connection
        modules = connection.modules
        self._lane, self._person, self._polygon = modules.lane, modules.person, modules.polygon
        self._route, self._simulation = modules.route, modules.simulation
        self._lights, self._vehicle = modules.trafficlight, modules.vehicle
        self._type = modules.vehicletype
        self.net = Net(modules, origin)
        self._shift = np.array(self.net.origin)
        self._watched_vehicles = connection.watch(modules.vehicle)
        self._watched_persons = connection.watch(modules.person, text="getVehicle")
        self._watched_lights = connection.watch(
            modules.trafficlight, poses=False, text="getRedYellowGreenState"
        )

    def reached(self) -> AbstractContextManager[None]:
        """Within it, SUMO that is gone raises SumoError, whatever it was asked for."""
        return self._connection.reached()

    def close(self) -> None:
        """End the simulation, or leave one that others have started; twice is harmless."""
        self._connection.close()

    def step(self) -> None:
        """Advance by one step; vehicles added since the last one are inserted at its end."""
        self._connection.step()

    @property
    def time(self) -> float:
        """SUMO's own time [s]."""
        return float(self._simulation.getTime())

    # ---- the scene

    def types(self) -> list[str]:
        """Vehicle types of the scene, sorted by name, without SUMO's built-in ones."""
        return sorted(t for t in self._type.getIDList() if not t.startswith("DEFAULT_"))

    def has_type(self, kind: str) -> bool:
        """Whether there is a vehicle type `kind`, built-in ones included."""
        return kind in self._type.getIDList()

    def type_size(self, kind: str) -> tuple[float, float, float]:
        """Length, width and height [m]."""
        of = self._type
        return of.getLength(kind), of.getWidth(kind), of.getHeight(kind)

    def type_class(self, kind: str) -> str:
        """SUMO's `vClass` of a vehicle type."""
        return str(self._type.getVehicleClass(kind))

    def type_parameter(self, kind: str, key: str) -> str:
        """The value of `<param key="...">` in a vehicle type, empty if there is none."""
        return str(self._type.getParameter(kind, key))

    def min_gap(self, kind: str) -> float:
        """How far vehicles of this type stay behind one that stands [m]."""
        return float(self._type.getMinGap(kind))

    def stop_gap(self, kind: str) -> float:
        """How far before a stop line vehicles of this type come to rest [m]."""
        return float(self._type.getParameter(kind, "junctionModel.jmStoplineGap") or _STOP_GAP)

    def polygons(self) -> list[str]:
        """All polygons, sorted by name."""
        return sorted(self._polygon.getIDList())

    def polygon_type(self, polygon: str) -> str:
        """What its attribute `type` says."""
        return str(self._polygon.getType(polygon))

    def polygon_shape(self, polygon: str) -> Float:
        """Vertices [m], shape (vertex, 2), as written: open or closed ring."""
        return self.net.relative(self._polygon.getShape(polygon))

    def polygon_parameter(self, polygon: str, key: str) -> str:
        """The value of `<param key="...">` in a polygon, empty if there is none."""
        return str(self._polygon.getParameter(polygon, key))

    # ---- traffic lights

    def lights(self) -> list[str]:
        """All traffic lights, sorted by name."""
        return sorted(self._lights.getIDList())

    def controlled_lanes(self, light: str) -> list[list[str]]:
        """The lanes that each index of `light` rules, each once, in SUMO's order."""
        return [
            list(dict.fromkeys(lane for lane, _, _ in links))
            for links in self._lights.getControlledLinks(light)
        ]

    def light_states(self, lights: Sequence[str]) -> list[str]:
        """The state of each of `lights`: one of SUMO's letters for each of its signals."""
        return self._watched_lights.texts(lights)

    # ---- vehicles

    def occupancy(self, lane: str) -> int:
        """Number of vehicles on `lane`."""
        return int(self._lane.getLastStepVehicleNumber(lane))

    def add_route(self, name: str, edges: Sequence[str]) -> None:
        """Declare a route, once per name."""
        self._route.add(name, list(edges))

    def add(self, departure: Departure) -> None:
        """Have a vehicle inserted at the end of the next step, if there is room then.

        Raises:
            SumoError: SUMO has one of that name already, or cannot insert it there.
        """
        with self._adding(departure.name):
            self._vehicle.add(
                departure.name,
                departure.route,
                departure.type,
                departLane=str(departure.lane),
                departPos=f"{departure.position:.6f}",
                departSpeed="max" if departure.speed is None else f"{departure.speed:.6f}",
            )
        if not departure.changes_lanes:
            self._vehicle.setLaneChangeMode(departure.name, _NO_LANE_CHANGES)
        if not departure.looks_ahead:  # SUMO checks what is on the route, so that ends here
            self._vehicle.setRoute(departure.name, self._route.getEdges(departure.route)[:1])

    def set_out(self, departure: Departure) -> None:
        """Give a vehicle that has entered without looking ahead its whole route."""
        self._vehicle.setRouteID(departure.name, departure.route)

    def set_present_speed(self, name: str, speed: float) -> None:
        """Let `name` have had `speed` [m/s] in the last step, above the limit, too."""
        self._vehicle.setPreviousSpeed(name, speed)

    def park(self, name: str, edge: str, lane: int, position: float) -> None:
        """Have a vehicle that was just added stand beside the road.

        Args:
            name: of the vehicle.
            edge: that it is on.
            lane: index of its lane.
            position: of its front bumper, from the start of the lane [m].
        """
        self._vehicle.setStop(name, edge, position, lane, _FOR_EVER, _PARKED)

    def add_near(self, name: str, kind: str, front: Float) -> None:
        """Have a vehicle inserted that is moved from then on, on the lane nearest to a point.

        Args:
            name: of the vehicle.
            kind: its type.
            front: of its body [m], shape (2,).

        Raises:
            SumoError: SUMO has one of that name already, or no lane is near.
        """
        edge, _ = self._nearest(front, self.type_class(kind))
        route = route_name(name)
        with self._adding(name):
            self.add_route(route, [edge])
            self._vehicle.add(name, route, kind, departLane="best", departSpeed="0")

    def add_person(self, name: str, kind: str, front: Float) -> None:
        """Have a person enter that is moved from then on, on the edge nearest to a point.

        Args:
            name: of the person.
            kind: its type.
            front: of its body [m], shape (2,).

        Raises:
            SumoError: SUMO has one of that name already, or no edge is near.
        """
        edge, position = self._nearest(front)
        with self._adding(name):
            self._person.add(name, edge, position, typeID=kind)
            self._person.appendWaitingStage(name, _FOR_EVER)

    def _nearest(self, front: Float, vehicle_class: str = "ignoring") -> tuple[str, float]:
        """The nearest edge, and the position on it [m]."""
        x, y = (front + self._shift).tolist()
        try:
            edge, position, _ = self._simulation.convertRoad(x, y, vClass=vehicle_class)
        except self._connection.refusal as error:
            raise SumoError(
                f"SUMO finds no lane near ({front[0]:g}, {front[1]:g}) m ({error}); begin closer "
                "to the roads of the net"
            ) from error
        return str(edge), float(position)

    def move_person(self, name: str, front: Float, heading: float) -> None:
        """Put a person somewhere at the end of the next step.

        Args:
            name: of the person.
            front: the middle of its front [m], shape (2,).
            heading: counter-clockwise from east [rad].
        """
        angle = 90.0 - math.degrees(heading)
        x, y = (front + self._shift).tolist()
        self._person.moveToXY(name, "", x, y, angle, _EXACTLY_THERE, _MATCH_RADIUS)

    def is_pending(self, name: str) -> bool:
        """Whether a vehicle waits for room to enter."""
        return name in self._simulation.getPendingVehicles()

    def withdraw(self, name: str) -> None:
        """Take a vehicle out of the simulation, whether or not it was inserted."""
        self._vehicle.remove(name)

    def departed(self) -> frozenset[str]:
        """Vehicles inserted in the last step."""
        return frozenset(self._simulation.getDepartedIDList())

    def vehicles(self) -> Sequence[str]:
        """All vehicles on the road or parked beside it, in SUMO's order."""
        found: Sequence[str] = self._vehicle.getIDList()
        return found

    def lifted(self) -> frozenset[str]:
        """Vehicles that SUMO lifted off the road in the last step; it may have put them down."""
        return frozenset(self._simulation.getStartingTeleportIDList())

    def type_of(self, vehicle: str) -> str:
        """The type of a vehicle."""
        return str(self._vehicle.getTypeID(vehicle))

    def persons(self) -> list[str]:
        """All persons on foot or waiting; who rides is where the vehicle is, and no body."""
        persons = self._person.getIDList()
        within = self._watched_persons.texts(persons)
        return [person for person, ride in zip(persons, within, strict=True) if not ride]

    def type_of_person(self, person: str) -> str:
        """The type of a person."""
        return str(self._person.getTypeID(person))

    def vehicle_poses(self, names: Sequence[str]) -> Float:
        """Front bumper x, y [m], SUMO angle [degrees] and speed [m/s], shape (vehicle, 4)."""
        return self._shifted(self._watched_vehicles.poses(names))

    def person_poses(self, names: Sequence[str]) -> Float:
        """Poses of persons, shape (person, 4); see `vehicle_poses`."""
        return self._shifted(self._watched_persons.poses(names))

    def _shifted(self, poses: Float) -> Float:
        poses[:, :2] -= self._shift
        return poses

    def ignore_everything(self, name: str) -> None:
        """Let `name` drive at the speed it is told, through red lights and other vehicles."""
        self._vehicle.setSpeedMode(name, _ALL_CHECKS_OFF)

    def set_speed(self, name: str, speed: float | None) -> None:
        """Speed [m/s] of the next steps; `None` hands it back to the car-following model."""
        self._vehicle.setSpeed(name, _RELEASE if speed is None else speed)

    def move(self, name: str, front: Float, heading: float, *, exactly: bool = False) -> None:
        """Put `name` with its front bumper at `front` [m] at the end of the next step.

        Args:
            name: of the vehicle.
            front: centre of the front bumper [m], shape (2,).
            heading: counter-clockwise from east [rad].
            exactly: whether SUMO's drivers see it right there, on whatever lane or on none,
                rather than on the lane of its route.

        Raises:
            SumoError: its route is too far away.
        """
        angle = 90.0 - math.degrees(heading)
        x, y = (front + self._shift).tolist()
        keep = _EXACTLY_THERE if exactly else _KEEP_ROUTE
        try:
            self._vehicle.moveToXY(name, "", -1, x, y, angle, keep, _MATCH_RADIUS)
        except self._connection.refusal as error:
            raise SumoError(
                f"`{name}` has left its route: its front is at ({front[0]:.1f}, {front[1]:.1f}) m "
                f"and no lane of the route is near ({error})"
            ) from error

    @contextmanager
    def _adding(self, name: str) -> Iterator[None]:
        """Say whom SUMO refuses."""
        try:
            yield
        except self._connection.refusal as error:
            raise SumoError(f"SUMO refuses `{name}`: {error}") from error


def route_name(entity: str) -> str:
    """The name of the route of an entity, which the scene's own routes do not have."""
    return f"entities.{entity}"
