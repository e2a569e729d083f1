"""SUMO in this process: the only module that calls libsumo.

libsumo keeps its simulation in global variables, so there is one per process. `Sumo` owns it
from `open` to `close` and speaks arrays, paths and this package's errors.
"""

import contextlib
import itertools
import math
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from adapters.traffic.geometry import Float
from orchestrator.errors import CosimError
from orchestrator.timebase import Duration, seconds

with contextlib.redirect_stdout(sys.stderr):  # it may print about pyarrow, among our results
    import libsumo

_ALL_CHECKS_OFF: Final = 0
"""Speed mode: right of way, lights, other vehicles and bounds of acceleration are ignored."""

_NO_LANE_CHANGES: Final = 0
"""Lane-change mode: none, for whatever reason."""

_KEEP_ROUTE: Final = 1
"""`moveToXY` maps the vehicle to its route only, never to the nearest other lane."""

_MATCH_RADIUS: Final = 1000.0
"""How far from its route [m] a moved vehicle may be; SUMO shows it on the nearest lane."""

_RELEASE: Final = -1.0
"""`setSpeed` with this value hands the speed back to the car-following model."""


class SumoError(CosimError):
    """SUMO cannot start, or cannot do what the scenario asks for."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Link:
    """A way over a junction: from the end of one lane to the start of another."""

    to_lane: str
    via: str
    direction: str
    """`s` straight, `l` left, `r` right, `t` turn-around (SUMO's letters)."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Departure:
    """A vehicle to be inserted at the end of the next step.

    Attributes:
        position: of the front bumper, from the start of the lane [m].
        speed: [m/s]; `None` for the highest that is safe.
    """

    name: str
    type: str
    route: str
    lane: int
    position: float
    speed: float | None


class Sumo:
    """The SUMO simulation of this process."""

    def __init__(self, config: Path, step_length: Duration, seed: int) -> None:
        """Start SUMO.

        Args:
            config: SUMO configuration (*.sumocfg) naming the net and additional files.
            step_length: of SUMO [ns], a whole number of milliseconds.
            seed: of SUMO's own random numbers, 0..2^31-1.

        Raises:
            SumoError: another simulation is open, or SUMO refuses the files.
        """
        if libsumo.simulation.isLoaded():
            raise SumoError(
                "SUMO can run once per process, and it is running already; give all but one "
                "`sumo-traffic` component a `process:` of their own, or close the other one first"
            )
        options = {
            "--configuration-file": str(config),
            "--step-length": f"{seconds(step_length):.3f}",
            "--seed": str(seed),
            "--collision.action": "none",  # bodies are checked here, exactly; SUMO must not act
            "--time-to-teleport": "-1",  # a blocked vehicle waits; it never jumps
            "--max-depart-delay": "0",  # a vehicle that does not fit in now is dropped
            "--eager-insert": "true",  # one that does not fit must not hold up the others
            "--no-step-log": "true",
            "--no-warnings": "true",
            "--duration-log.disable": "true",
        }
        try:
            libsumo.start(["sumo", *(part for option in options.items() for part in option)])
        except libsumo.TraCIException as error:
            raise SumoError(
                f"SUMO cannot load `{config}`: {error} (SUMO's own message is on standard error)"
            ) from error
        self._closed = False

    def close(self) -> None:
        """End the simulation. Calling it twice is harmless."""
        if not self._closed:
            self._closed = True
            libsumo.close()

    def step(self) -> None:
        """Advance by one step; vehicles added since the last one are inserted at its end."""
        libsumo.simulationStep()

    # ---- the scene

    def lanes(self) -> list[str]:
        """Lanes outside junctions, sorted by name."""
        return sorted(lane for lane in libsumo.lane.getIDList() if not lane.startswith(":"))

    def edge_of(self, lane: str) -> str:
        """The edge that `lane` belongs to."""
        return str(libsumo.lane.getEdgeID(lane))

    def index_of(self, lane: str) -> int:
        """The index of `lane` on its edge; 0 is the rightmost."""
        return int(lane.rsplit("_", 1)[1])

    def lane_length(self, lane: str) -> float:
        """The length of `lane` [m]."""
        return float(libsumo.lane.getLength(lane))

    def lane_width(self, lane: str) -> float:
        """The width of `lane` [m]."""
        return float(libsumo.lane.getWidth(lane))

    def allows_cars(self, lane: str) -> bool:
        """Whether passenger cars may use `lane`: no sidewalk, no rail."""
        return "passenger" in libsumo.lane.getAllowed(lane)

    def ends_of(self, edge: str) -> tuple[str, str]:
        """The junctions that `edge` comes from and leads to."""
        return libsumo.edge.getFromJunction(edge), libsumo.edge.getToJunction(edge)

    def junction_shape(self, junction: str) -> Float:
        """Vertices [m], shape (vertex, 2), as written: open or closed ring; there may be none."""
        shape = libsumo.junction.getShape(junction)
        return np.array(shape, dtype=np.float64).reshape(len(shape), -1)[:, :2].reshape(-1, 2)

    def lane_shape(self, lane: str) -> Float:
        """Centre line [m], shape (vertex, 2)."""
        return np.array(libsumo.lane.getShape(lane), dtype=np.float64)[:, :2]

    def links(self, lane: str) -> list[Link]:
        """Where `lane` leads, from right to left."""
        return [
            Link(to_lane=to, via=via, direction=letter)
            for to, _, _, _, via, _, letter, _ in libsumo.lane.getLinks(lane)
        ]

    def occupancy(self, lane: str) -> int:
        """Number of vehicles on `lane`."""
        return int(libsumo.lane.getLastStepVehicleNumber(lane))

    def speed_limit(self, lane: str) -> float:
        """The speed limit on `lane` [m/s]."""
        return float(libsumo.lane.getMaxSpeed(lane))

    def types(self) -> list[str]:
        """Vehicle types of the scene, sorted by name, without SUMO's built-in ones."""
        return sorted(t for t in libsumo.vehicletype.getIDList() if not t.startswith("DEFAULT_"))

    def type_size(self, kind: str) -> tuple[float, float, float]:
        """Length, width and height [m]."""
        domain = libsumo.vehicletype
        return domain.getLength(kind), domain.getWidth(kind), domain.getHeight(kind)

    def type_parameter(self, kind: str, key: str) -> str:
        """The value of `<param key="...">` in a vehicle type, empty if there is none."""
        return str(libsumo.vehicletype.getParameter(kind, key))

    def stop_gap(self, kind: str) -> float:
        """How far before a stop line vehicles of this type come to rest [m]."""
        return float(libsumo.vehicletype.getParameter(kind, "junctionModel.jmStoplineGap"))

    def polygons(self) -> list[str]:
        """All polygons, sorted by name."""
        return sorted(libsumo.polygon.getIDList())

    def polygon_type(self, polygon: str) -> str:
        """What its attribute `type` says."""
        return str(libsumo.polygon.getType(polygon))

    def polygon_shape(self, polygon: str) -> Float:
        """Vertices [m], shape (vertex, 2), as written: open or closed ring."""
        return np.array(libsumo.polygon.getShape(polygon), dtype=np.float64)[:, :2]

    def polygon_parameter(self, polygon: str, key: str) -> str:
        """The value of `<param key="...">` in a polygon, empty if there is none."""
        return str(libsumo.polygon.getParameter(polygon, key))

    # ---- vehicles

    def add_route(self, name: str, edges: Sequence[str]) -> None:
        """Declare a route, once per name."""
        libsumo.route.add(name, list(edges))

    def add(self, departure: Departure) -> None:
        """Have a vehicle inserted at the end of the next step, if there is room then."""
        libsumo.vehicle.add(
            departure.name,
            departure.route,
            departure.type,
            departLane=str(departure.lane),
            departPos=f"{departure.position:.6f}",
            departSpeed="max" if departure.speed is None else f"{departure.speed:.6f}",
        )
        libsumo.vehicle.setLaneChangeMode(departure.name, _NO_LANE_CHANGES)

    def withdraw(self, name: str) -> None:
        """Take a vehicle out of the simulation, whether or not it was inserted."""
        libsumo.vehicle.remove(name)

    def departed(self) -> frozenset[str]:
        """Vehicles inserted in the last step."""
        return frozenset(libsumo.simulation.getDepartedIDList())

    def arrived(self) -> frozenset[str]:
        """Vehicles that left the net in the last step."""
        return frozenset(libsumo.simulation.getArrivedIDList())

    def poses(self, names: Sequence[str]) -> Float:
        """Front bumper x, y [m], SUMO angle [degrees] and speed [m/s], shape (vehicle, 4)."""
        vehicle, count = libsumo.vehicle, len(names)
        poses = np.empty((count, 4))
        places = itertools.chain.from_iterable(map(vehicle.getPosition, names))
        poses[:, :2] = np.fromiter(places, np.float64, 2 * count).reshape(count, 2)
        poses[:, 2] = np.fromiter(map(vehicle.getAngle, names), np.float64, count)
        poses[:, 3] = np.fromiter(map(vehicle.getSpeed, names), np.float64, count)
        return poses

    def ignore_everything(self, name: str) -> None:
        """Let `name` drive at the speed it is told, through red lights and other vehicles."""
        libsumo.vehicle.setSpeedMode(name, _ALL_CHECKS_OFF)

    def set_speed(self, name: str, speed: float | None) -> None:
        """Speed [m/s] of the next steps; `None` hands it back to the car-following model."""
        libsumo.vehicle.setSpeed(name, _RELEASE if speed is None else speed)

    def move(self, name: str, front: Float, heading: float) -> None:
        """Put `name` with its front bumper at `front` [m] at the end of the next step.

        Args:
            name: of the vehicle.
            front: centre of the front bumper [m], shape (2,).
            heading: counter-clockwise from east [rad].

        Raises:
            SumoError: its route is too far away.
        """
        angle = 90.0 - math.degrees(heading)
        try:
            libsumo.vehicle.moveToXY(
                name, "", -1, front[0], front[1], angle, _KEEP_ROUTE, _MATCH_RADIUS
            )
        except libsumo.TraCIException as error:
            raise SumoError(
                f"`{name}` has left its route: its front is at ({front[0]:.1f}, {front[1]:.1f}) m "
                f"and no lane of the route is near ({error})"
            ) from error
