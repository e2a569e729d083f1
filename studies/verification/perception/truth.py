r"""What the ego vehicle does not know of the road, and what each candidate would add.

It is all geometry.

*Known* to a sensor is the ground that it sees, the footprint of its own vehicle, and the footprints
of the vehicles that it sees: an occupied spot is not hidden. *Hidden* is what the ego vehicle does
not know of its area of interest: the road surface within `corridor` of its route, not nearer than
the ground below the lowest channel, not farther than `horizon`.

*Exact matrices* say what matrices of a certain cell size could do at best. If every vehicle knew
exactly which share of each cell of its matrix it sees, the ego vehicle could expect a candidate to
reveal

$$ \int_{road} (1 - e(x)) v(x) dx $$

where e is the seen share of the ego vehicle's cell in which x lies, v that of the candidate's cell.
It is an expectation because nobody knows where in a cell the seen part is. Whoever it ranks first
is the best that matrices of this size can do without that knowledge.
"""

from collections.abc import Mapping, Set
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt
import shapely
from shapely.geometry import LineString, Point
from shapely.geometry.base import BaseGeometry

from studies.verification.perception.scene import Float, Scene, Vehicle
from studies.verification.perception.visibility import Sensor, obstacles, seen_vehicles, visible


@dataclass(frozen=True, slots=True, kw_only=True)
class Interest:
    """Which part of the road matters to the ego vehicle.

    Attributes:
        corridor: reach beside the planned route [m].
        horizon: largest distance from its sensor [m].
    """

    corridor: float = 25.0
    horizon: float = 35.0

    def area(self, scene: Scene) -> BaseGeometry:
        """Find the area of interest [m]."""
        sensor = sensor_of(scene, scene.ego)
        center = Point(sensor.position)
        ring = center.buffer(self.horizon, quad_segs=64).difference(
            center.buffer(sensor.near, quad_segs=64)
        )
        beside = LineString(scene.route).buffer(self.corridor, quad_segs=32)
        return shapely.intersection_all([scene.road, ring, beside])


@dataclass(frozen=True, slots=True, kw_only=True)
class Truth:
    """What is so, whatever the perception unit finds.

    Attributes:
        interest: the area of interest.
        hidden: the part of it that the ego vehicle does not know.
        known: the part of it that each equipped vehicle knows, by id.
        revealed: the part of `hidden` that each candidate knows, by id.
        hidden_vehicles: ids of those whose centre is in `interest` and that the ego vehicle does
            not see.
        seen: ids of the vehicles that each equipped vehicle sees, by its id.
    """

    interest: BaseGeometry
    hidden: BaseGeometry
    known: Mapping[int, BaseGeometry]
    revealed: Mapping[int, BaseGeometry]
    hidden_vehicles: Set[int]
    seen: Mapping[int, Set[int]]

    @property
    def areas(self) -> dict[int, float]:
        """What each candidate reveals [m^2], by id."""
        return {candidate: float(area.area) for candidate, area in self.revealed.items()}

    @property
    def best(self) -> float:
        """What the candidate that reveals most reveals [m^2]."""
        return max(self.areas.values(), default=0.0)

    def found_by(self, sharer: int) -> set[int]:
        """Find the hidden vehicles that `sharer` reveals by what it sees and where it is."""
        return set(self.hidden_vehicles) & {sharer, *self.seen[sharer]}


def sensor_of(scene: Scene, vehicle: int) -> Sensor:
    """Find the lidar of one vehicle."""
    carrier = scene.by_id[vehicle]
    return Sensor(position=carrier.position, height=carrier.sensor_height)


def find_truth(scene: Scene, interest: Interest) -> Truth:
    """Find what is hidden in `scene`, and who reveals it."""
    area = interest.area(scene)
    seen = {
        one: seen_vehicles(sensor_of(scene, one), one, scene.vehicles, scene.buildings)
        for one in scene.equipped
    }
    known = {one: _known(scene, one, seen[one], area) for one in scene.equipped}
    hidden = shapely.difference(area, known[scene.ego])
    revealed = {one: _surface(shapely.intersection(hidden, known[one])) for one in scene.candidates}
    absent = {
        one.id
        for one in scene.vehicles
        if one.id != scene.ego
        and one.id not in seen[scene.ego]
        and area.contains(Point(one.position))
    }
    return Truth(
        interest=area,
        hidden=hidden,
        known=known,
        revealed=revealed,
        hidden_vehicles=absent,
        seen=seen,
    )


def _surface(area: BaseGeometry) -> BaseGeometry:
    """Leave out the lines and points along which two areas touch."""
    parts = shapely.get_parts(shapely.get_parts(area))  # of collections, then of their members
    polygons = parts[shapely.get_type_id(parts) == shapely.GeometryType.POLYGON]
    return shapely.MultiPolygon(list(polygons))


def _known(scene: Scene, observer: int, seen: Set[int], ground: BaseGeometry) -> BaseGeometry:
    """The part of `ground` that an equipped vehicle knows about."""
    prisms = obstacles(scene.vehicles, scene.buildings, observer)
    free = visible(sensor_of(scene, observer), prisms, ground)
    vehicles = scene.by_id
    taken = shapely.union_all([vehicles[one].footprint for one in (*seen, observer)])
    return shapely.union(free, shapely.intersection(taken, ground))


Bool = npt.NDArray[np.bool_]

CELLS: Final = (5.0, 2.5, 1.25)
"""Sides of the cells [m]."""
_STEP: Final = 0.5
"""Distance of the points that areas are sampled at [m]."""


def best_by_cells(
    scene: Scene, interest: BaseGeometry, known: Mapping[int, BaseGeometry], cell: float
) -> int:
    """Choose the candidate that exact matrices with cells of this side would.

    Args:
        scene: what there is.
        interest: the ego vehicle's area of interest.
        known: the part of it that each equipped vehicle knows, by id.
        cell: side of a cell [m].
    """
    points = _points(interest)
    shares = {
        one: _shares(points, shapely.contains_xy(area, points[:, 0], points[:, 1]), vehicle, cell)
        for one, area in known.items()
        for vehicle in (scene.by_id[one],)
    }
    wanted = 1.0 - shares[scene.ego]
    return max(scene.candidates, key=lambda one: float(wanted @ shares[one]))


def _points(area: BaseGeometry) -> Float:
    low_x, low_y, high_x, high_y = area.bounds
    x, y = np.meshgrid(
        np.arange(low_x + _STEP / 2, high_x, _STEP), np.arange(low_y + _STEP / 2, high_y, _STEP)
    )
    inside = shapely.contains_xy(area, x.ravel(), y.ravel())
    return np.column_stack([x.ravel()[inside], y.ravel()[inside]])


def _shares(points: Float, seen: Bool, vehicle: Vehicle, cell: float) -> Float:
    """Find the seen share of the points in the cell of each point, shape (point,)."""
    cosine, sine = np.cos(vehicle.heading), np.sin(vehicle.heading)
    local = (points - np.array(vehicle.position)) @ np.array([[cosine, -sine], [sine, cosine]])
    index = np.floor(local / cell).astype(np.int64)
    _, place = np.unique(index, axis=0, return_inverse=True)
    share: Float = np.bincount(place, seen.astype(float)) / np.bincount(place)
    return share[place]
