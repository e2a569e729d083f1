"""What the ego vehicle does not know of the road, and what each candidate would add. Geometry only.

*Known* to a sensor is the ground that it sees, the footprint of its own vehicle, and the footprints
of the vehicles that it sees: an occupied spot is not hidden. *Hidden* is what the ego vehicle does
not know of its area of interest: the road surface within `corridor` of its route, not nearer than
the ground below the lowest channel, not farther than `horizon`.
"""

from collections.abc import Mapping, Set
from dataclasses import dataclass

import shapely
from shapely.geometry import LineString, Point
from shapely.geometry.base import BaseGeometry

from studies.verification.perception.bodies import obstacles
from studies.verification.perception.scene import Scene
from studies.verification.perception.shadow import Sensor, visible
from studies.verification.perception.sight import seen_vehicles


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
        """The area of interest."""
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
        """Hidden vehicles that become known if `sharer` tells what it sees, and where it is."""
        return set(self.hidden_vehicles) & {sharer, *self.seen[sharer]}


def sensor_of(scene: Scene, vehicle: int) -> Sensor:
    """The lidar of one vehicle."""
    carrier = scene.by_id[vehicle]
    return Sensor(position=carrier.position, height=carrier.sensor_height)


def find_truth(scene: Scene, interest: Interest) -> Truth:
    """What is hidden in `scene`, and who reveals it."""
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
    """Without the lines and points along which two areas touch."""
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
