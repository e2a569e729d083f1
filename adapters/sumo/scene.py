"""What the scene consists of: vehicle types, buildings and paths along lanes."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final, TypeVar

import numpy as np
import numpy.typing as npt

from adapters.sumo.simulation import Link, Sumo, SumoError
from adapters.traffic.geometry import Float
from adapters.traffic.polyline import Polyline

BODIES: Final = MappingProxyType({"car": 0, "suv": 1, "van": 2, "bus": 3, "truck": 4})
"""Codes of `vehicle.body`, by the names used in vehicle types."""

Scalar = TypeVar("Scalar", bound=np.generic)

_BUILDING: Final = "building"
_SAME_POINT: Final = 0.01
"""Vertices closer than this [m] are one: SUMO writes coordinates with two decimals."""


@dataclass(frozen=True, slots=True, kw_only=True)
class VehicleType:
    """What is known about every vehicle of a type.

    Attributes:
        size: length, width and height [m].
        antenna_height: above the ground [m].
        body: one of the codes in `BODIES`.
        share: weight among the background vehicles.
        stop_gap: to the stop line, when the vehicle waits there [m].
    """

    name: str
    size: tuple[float, float, float]
    antenna_height: float
    body: int
    share: float
    stop_gap: float

    @property
    def length(self) -> float:
        """The length of the body [m]."""
        return self.size[0]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Buildings:
    """All buildings; the arrays are read-only.

    Attributes:
        vertex: corners, open rings one after the other [m], shape (vertex, 2).
        index: the building each corner belongs to, int32, shape (vertex,).
        height: [m], shape (building,).
    """

    vertex: Float
    index: npt.NDArray[np.int32]
    height: Float


def read_types(sumo: Sumo) -> Mapping[str, VehicleType]:
    """The vehicle types of the scene, by name.

    Raises:
        SumoError: a type lacks a parameter or has a wrong one; all of them are named.
    """
    problems: list[str] = []
    types = {name: _read_type(sumo, name, problems) for name in sumo.types()}
    if not types:
        problems.append("the scene declares no vehicle type; add `<vType>` elements to it")
    elif sum(kind.share for kind in types.values()) <= 0.0:
        problems.append(
            'no vehicle type has a positive `share`; add `<param key="share" value="1"/>` to one'
        )
    if problems:
        raise SumoError("\n".join(problems))
    return MappingProxyType(types)


def read_buildings(sumo: Sumo) -> Buildings:
    """The polygons of type `building`, ordered by name.

    Raises:
        SumoError: a building is no polygon or has no height; all of them are named.
    """
    problems: list[str] = []
    names = [name for name in sumo.polygons() if sumo.polygon_type(name) == _BUILDING]
    rings, heights = [], []
    for name in names:
        ring = open_ring(sumo.polygon_shape(name))
        if len(ring) < 3:
            problems.append(f"building `{name}` has {len(ring)} corners, at least 3 are needed")
        text = sumo.polygon_parameter(name, "height")
        heights.append(_positive(text, f"building `{name}`: `height`", problems))
        rings.append(ring)
    if problems:
        raise SumoError("\n".join(problems))
    index = np.repeat(np.arange(len(rings), dtype=np.int32), [len(ring) for ring in rings])
    vertex = np.concatenate([np.zeros((0, 2)), *rings])
    return Buildings(vertex=frozen(vertex), index=frozen(index), height=frozen(np.array(heights)))


def open_ring(ring: Float) -> Float:
    """`ring`, shape (vertex, 2), without a last vertex that repeats the first."""
    closes = len(ring) > 1 and bool(np.hypot(*(ring[0] - ring[-1])) < _SAME_POINT)
    return ring[:-1] if closes else ring


def frozen(array: npt.NDArray[Scalar]) -> npt.NDArray[Scalar]:
    """`array` itself, of any shape, from now on read-only."""
    array.flags.writeable = False
    return array


def straight_on(sumo: Sumo, lane: str) -> Link:
    """Where a vehicle that does not want to turn leaves `lane`: straight on, or the only way.

    Raises:
        SumoError: the lane leads nowhere, or to several places and none is straight on.
    """
    links = sumo.links(lane)
    straight = [link for link in links if link.direction == "s"]
    if len(straight or links) != 1:
        raise SumoError(
            f"lane `{lane}` must lead straight on or have exactly one connection; "
            f"it leads to {[link.to_lane for link in links]}"
        )
    return (straight or links)[0]


def path_over(sumo: Sumo, lane: str, link: Link) -> Polyline:
    """Centre line along `lane`, over the junction and along the next lane."""
    shapes = [sumo.lane_shape(lane)]
    inner = link.via
    while inner.startswith(":"):  # a left turn may wait half-way: two inner lanes
        shapes.append(sumo.lane_shape(inner))
        inner = next((step.via or step.to_lane for step in sumo.links(inner)), "")
    shapes.append(sumo.lane_shape(link.to_lane))
    vertices = np.concatenate(shapes)
    step = np.hypot(*np.diff(vertices, axis=0).T)
    return Polyline(vertices[np.concatenate([[True], step > _SAME_POINT])])


def _read_type(sumo: Sumo, name: str, problems: list[str]) -> VehicleType:
    place = f"vehicle type `{name}`"
    body = sumo.type_parameter(name, "body")
    if body not in BODIES:
        problems.append(f"{place}: `body` must be one of {', '.join(BODIES)}, got `{body}`")
    share = sumo.type_parameter(name, "share")
    antenna = sumo.type_parameter(name, "antenna_height")
    return VehicleType(
        name=name,
        size=sumo.type_size(name),
        antenna_height=_positive(antenna, f"{place}: `antenna_height`", problems),
        body=BODIES.get(body, 0),
        share=_positive(share, f"{place}: `share`", problems) if share else 0.0,
        stop_gap=sumo.stop_gap(name),
    )


def _positive(text: str, what: str, problems: list[str]) -> float:
    """The number in `text`; where it is none or not positive, a problem is noted."""
    try:
        value = float(text)
    except ValueError:
        value = 0.0
    if not 0.0 < value < np.inf:
        problems.append(f"{what} must be a positive number in a `<param>`, got `{text}`")
    return value
