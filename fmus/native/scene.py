"""What several units see of the scene: vehicles, buildings and roads, as FMI variables."""

from dataclasses import replace
from typing import Final, Literal, TypeAlias

from fmus.messages.bodies import BODY_CODES
from fmus.native.interface import Variable, VariableType, discrete_input, length

VehicleField: TypeAlias = Literal[
    "id", "position", "heading", "size", "body", "antenna_height", "equipped", "lidar"
]
BuildingField: TypeAlias = Literal["vertex", "index", "height"]
RoadField: TypeAlias = Literal["vertex", "index"]


def _of_vehicle(
    field: VehicleField, kind: VariableType, description: str, *columns: int, unit: str = "1"
) -> Variable:
    axes: tuple[int | str, ...] = ("n_vehicle", *columns)
    return discrete_input(f"vehicle.{field}", kind, description, unit=unit, dimensions=axes)


_VEHICLE: Final[dict[VehicleField, Variable]] = {
    "id": _of_vehicle("id", "Int64", "Number of the vehicle, 0 to 2147483647, ascending"),
    "position": _of_vehicle(
        "position", "Float64", "Centre of the body's footprint; z is the ground", 3, unit="m"
    ),
    "heading": _of_vehicle("heading", "Float64", "Counter-clockwise from the x axis", unit="rad"),
    "size": _of_vehicle("size", "Float64", "Length, width, height of the body", 3, unit="m"),
    "body": _of_vehicle("body", "Int32", BODY_CODES),
    "antenna_height": _of_vehicle(
        "antenna_height", "Float64", "Above the ground, at the body's centre", unit="m"
    ),
    "equipped": _of_vehicle("equipped", "Boolean", "Has a radio"),
    "lidar": _of_vehicle("lidar", "Boolean", "Carries a lidar sensor"),
}


def _corners(what: str, description: str) -> Variable:
    """The corners of all polygons of a kind."""
    axes = (f"n_{what}_vertex", 2)
    return discrete_input(f"{what}.vertex", "Float64", description, unit="m", dimensions=axes)


def _owners(what: str, description: str) -> Variable:
    """Which polygon each corner belongs to."""
    axes = (f"n_{what}_vertex",)
    return discrete_input(f"{what}.index", "Int32", description, dimensions=axes)


_BUILDING: Final[dict[BuildingField, Variable]] = {
    "vertex": _corners(
        "building", "Corners of all buildings, ring by ring, open rings, either sense"
    ),
    "index": _owners(
        "building", "The building each corner belongs to, 0 to n_building - 1, ascending"
    ),
    "height": discrete_input(
        "building.height",
        "Float64",
        "Of the flat roof above z = 0",
        unit="m",
        dimensions=("n_building",),
    ),
}

_ROAD: Final[dict[RoadField, Variable]] = {
    "vertex": _corners(
        "road",
        "Corners of the polygons of the drivable surface, ring by ring, open rings, either sense; "
        "they may overlap. Fewer than two corners: the road is everywhere",
    ),
    "index": _owners("road", "The polygon each corner belongs to, ascending"),
}


def vehicle(field: VehicleField, *, start: float = 0) -> Variable:
    """The input `vehicle.<field>`, one entry per vehicle."""
    return replace(_VEHICLE[field], start=start)


def building(field: BuildingField, *, start: float = 0) -> Variable:
    """The input `building.<field>`, one entry per building, or per corner of all buildings."""
    return replace(_BUILDING[field], start=start)


def road(field: RoadField) -> Variable:
    """The input `road.<field>`, one entry per corner of all polygons of the drivable surface."""
    return _ROAD[field]


def n_vehicle(*, maximum: int | None = None) -> Variable:
    """The structural parameter `n_vehicle`, the number of vehicles; `maximum` bounds it."""
    return length("n_vehicle", 1, 0, maximum, "Number of vehicles")


def n_building_vertex(*, maximum: int | None = None) -> Variable:
    """The structural parameter `n_building_vertex`; it starts with one building, a triangle."""
    return length("n_building_vertex", 3, 0, maximum, "Number of corners of all buildings")


def n_building(*, maximum: int | None = None) -> Variable:
    """The structural parameter `n_building`, the number of buildings; `maximum` bounds it."""
    return length("n_building", 1, 0, maximum, "Number of buildings")


def n_road_vertex(*, maximum: int | None = None) -> Variable:
    """The structural parameter `n_road_vertex`; it starts with one corner, which is no road."""
    return length("n_road_vertex", 1, 0, maximum, "Number of corners of the drivable surface")
