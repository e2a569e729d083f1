"""What the scene consists of: vehicle types, buildings, roads and paths along lanes."""

import logging
from collections.abc import Iterable, Sequence, Set
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
import numpy.typing as npt

from adapters.sumo.checks.polygons import height_in, is_building
from adapters.sumo.errors import SumoError
from adapters.sumo.net import Link, Net
from adapters.sumo.simulation import Sumo
from adapters.traffic.bodies import BODIES, Body, body_of
from adapters.traffic.polyline import Polyline
from adapters.traffic.surroundings import SAME_POINT, THIN, Buildings, area, open_ring

logger = logging.getLogger(__name__)

Scalar = TypeVar("Scalar", bound=np.generic)


@dataclass(frozen=True, slots=True, kw_only=True)
class VehicleType:
    """What is known about every road user of a type.

    Attributes:
        size: length, width and height [m].
        antenna_height: above the ground [m].
        body: its shape.
        share: weight among the background vehicles.
        stop_gap: to the stop line, when the vehicle waits there [m].
        vehicle_class: SUMO's `vClass`.
    """

    name: str
    size: tuple[float, float, float]
    antenna_height: float
    body: Body
    share: float
    stop_gap: float
    vehicle_class: str = "passenger"

    @property
    def length(self) -> float:
        """The length of the body [m]."""
        return self.size[0]


class VehicleTypes:
    """The vehicle types of a scene, each read when it is first asked for.

    SUMO knows size, height and class of every type, its own built-in ones included. `<param>`
    elements of a type say what it does not: `antenna_height`, `body` and `share`.

    Args:
        sumo: the simulation.
        antenna_above_roof: of types without `antenna_height` [m].
        distributions: names that are no types but distributions of them, which are not read.
    """

    def __init__(
        self, sumo: Sumo, antenna_above_roof: float, distributions: Set[str] = frozenset()
    ) -> None:
        self._sumo = sumo
        self._distributions = distributions
        self._above_roof = antenna_above_roof
        self._known: dict[str, VehicleType] = {}

    def __getitem__(self, name: str) -> VehicleType:
        """The type `name`.

        Raises:
            SumoError: a parameter of it is wrong.
        """
        found = self._known.get(name)
        if found is None:
            problems: list[str] = []
            found = self._read(name, problems)
            if problems:
                raise SumoError("\n".join(problems))
            self._known[name] = found
        return found

    def __contains__(self, name: str) -> bool:
        is_type = name in self._known or self._sumo.has_type(name)
        return is_type and name not in self._distributions

    def declared(self) -> list[VehicleType]:
        """The types that the scene declares, by name.

        Raises:
            SumoError: parameters of types are wrong; all of them are named.
        """
        problems: list[str] = []
        names = [name for name in self._sumo.types() if name not in self._distributions]
        for name in names:
            self._known[name] = self._read(name, problems)
        if problems:
            raise SumoError("\n".join(problems))
        return [self._known[name] for name in names]

    def _read(self, name: str, problems: list[str]) -> VehicleType:
        sumo, place = self._sumo, f"vehicle type `{name}`"
        size, vehicle_class = sumo.type_size(name), sumo.type_class(name)
        body = sumo.type_parameter(name, "body")
        if body and body not in BODIES:
            problems.append(f"{place}: `body` must be one of {', '.join(BODIES)}, got `{body}`")
        antenna = sumo.type_parameter(name, "antenna_height")
        share = sumo.type_parameter(name, "share")
        return VehicleType(
            name=name,
            size=size,
            antenna_height=positive(antenna, f"{place}: `antenna_height`", problems)
            if antenna
            else size[2] + self._above_roof,
            body=BODIES.get(body, body_of(vehicle_class, size[2])),
            share=positive(share, f"{place}: `share`", problems) if share else 0.0,
            stop_gap=sumo.stop_gap(name),
            vehicle_class=vehicle_class,
        )


def read_buildings(sumo: Sumo, default_height: float) -> Buildings:
    """The polygons of type `building` or `building.*`, ordered by name.

    Those without an area are left out; this and what else is left out is logged.

    Args:
        sumo: the simulation.
        default_height: of those whose parameter `height` is missing, or no positive number [m].
    """
    left_out: dict[str, int] = {}
    rings, heights = [], []
    for name in sumo.polygons():
        kind = sumo.polygon_type(name)
        ring = open_ring(sumo.polygon_shape(name))
        if not is_building(kind):
            left_out[kind] = left_out.get(kind, 0) + 1
        elif area(ring) < THIN:
            logger.info("building `%s` encloses no area, it is left out", name)
        else:
            text = sumo.polygon_parameter(name, "height")
            height = height_in(text) if text else default_height
            if height is None:
                logger.info("building `%s` has no height [m]: `%s`, the default holds", name, text)
            heights.append(default_height if height is None else height)
            rings.append(ring)
    for kind, count in sorted(left_out.items()):
        logger.info("%d polygons of type `%s` are no buildings", count, kind)
    return Buildings.of(rings, heights)


def frozen(array: npt.NDArray[Scalar]) -> npt.NDArray[Scalar]:
    """`array` itself, of any shape, from now on read-only."""
    array.flags.writeable = False
    return array


def straight_on(net: Net, lane: str) -> Link:
    """Where a vehicle that does not want to turn leaves `lane`: straight on, or the only way.

    Raises:
        SumoError: the lane leads nowhere, or to several places and none is straight on.
    """
    links = net.links(lane)
    straight = [link for link in links if link.direction == "s"]
    if len(straight or links) != 1:
        raise SumoError(
            f"lane `{lane}` must lead straight on or have exactly one connection; "
            f"it leads to {[link.to_lane for link in links]}"
        )
    return (straight or links)[0]


def path_over(net: Net, lane: str, links: Iterable[Link]) -> Polyline:
    """Centre line along `lane`, then over a junction and along the next lane for each link."""
    shapes = [net.lane_shape(lane)]
    for link in links:
        inner = link.via
        while inner.startswith(":"):  # a left turn may wait half-way: two inner lanes
            shapes.append(net.lane_shape(inner))
            inner = next((step.via or step.to_lane for step in net.links(inner)), "")
        shapes.append(net.lane_shape(link.to_lane))
    vertices = np.concatenate(shapes)
    step = np.hypot(*np.diff(vertices, axis=0).T)
    return Polyline(vertices[np.concatenate([[True], step > SAME_POINT])])


def links_along(net: Net, lane: str, edges: Sequence[str]) -> list[Link]:
    """The links that lead from `lane` along `edges` without a change of lanes.

    Where two lanes of an edge can be reached, the one from which the way goes on is taken, of
    several the rightmost.

    Raises:
        SumoError: there is no such way.
    """
    if not edges:
        return []
    for link in net.links(lane):
        if net.edge_of(link.to_lane) == edges[0]:
            try:
                return [link, *links_along(net, link.to_lane, edges[1:])]
            except SumoError:
                continue
    leading = [
        beside
        for beside in net.lanes_of(net.edge_of(lane))
        if any(net.edge_of(link.to_lane) == edges[0] for link in net.links(beside))
    ]
    hint = f"from {' and '.join(leading)} it does" if leading else "no lane beside it does either"
    raise SumoError(f"lane `{lane}` does not lead to edge `{edges[0]}` and on; {hint}")


def positive(text: str, what: str, problems: list[str]) -> float:
    """The number in `text`; where it is none or not positive, a problem is noted."""
    try:
        value = float(text)
    except ValueError:
        value = 0.0
    if not 0.0 < value < np.inf:
        problems.append(f"{what} must be a positive number in a `<param>`, got `{text}`")
    return value
