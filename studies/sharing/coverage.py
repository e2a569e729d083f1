"""What every candidate would have shown a requester at a moment of a run, by exact geometry.

The geometry is that of `nlosim verify perception` (studies/verification/perception/): what a lidar
sees of the ground by exact shadows, and vehicles by lines of sight. Here the scenes are those of a
recording.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np
import shapely
from shapely.geometry import Polygon
from shapely.geometry.base import BaseGeometry

from orchestrator.recording.reader import Recording
from orchestrator.signal import Array
from orchestrator.timebase import Time
from studies.verification.perception.scene import Building, Scene, Vehicle
from studies.verification.perception.truth import Interest, Truth, find_truth

REACH: Final = 50.0
"""Range of the lidars [m], the default of the unit."""
_MARGIN: Final = 15.0
"""Half the longest building or vehicle that stands partly within reach [m]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Surroundings:
    """What does not change in a run.

    Attributes:
        road: the drivable surface [m].
        buildings: beside it.
    """

    road: BaseGeometry
    buildings: tuple[Building, ...]

    @classmethod
    def of(cls, recording: Recording, road: str, building: str) -> "Surroundings":
        """Read them.

        Args:
            recording: of a run.
            road: what the names of the signals of the road begin with, `component.connector`.
            building: likewise of the buildings.
        """
        surface = _rings(recording, road)
        heights = np.asarray(recording[f"{building}.height"][0], float)
        houses = _rings(recording, building)
        return cls(
            road=shapely.union_all([Polygon(ring).buffer(0.0) for ring in surface.values()]),
            buildings=tuple(
                Building(ring=[(float(x), float(y)) for x, y in ring], height=float(heights[k]))
                for k, ring in houses.items()
            ),
        )

    def near(self, place: Array, radius: float) -> tuple[Building, ...]:
        """The buildings whose bounds come within `radius` of `place`, shape (2,); both in [m]."""
        found = []
        for building in self.buildings:
            ring = np.array(building.ring)
            nearest = np.clip(place, ring.min(axis=0), ring.max(axis=0))
            if np.linalg.norm(nearest - place) <= radius:
                found.append(building)
        return tuple(found)


def _rings(recording: Recording, name: str) -> Mapping[int, Array]:
    """The corners of each polygon [m], shape (corner, 2), by its index; lines are left out."""
    vertex = np.asarray(recording[f"{name}.vertex"][0], float).reshape(-1, 2)
    index = np.asarray(recording[f"{name}.index"][0]).ravel()
    found = {int(k): vertex[index == k] for k in np.unique(index)}
    return {k: ring for k, ring in found.items() if len(ring) > 2}


@dataclass(frozen=True, slots=True, kw_only=True)
class Source:
    """Where a recording says who is where.

    Attributes:
        vehicle: what the names of the signals of vehicles begin with, `component.connector`.
        ego: likewise those of the requester, beneath which `id` and `route` are.
        interest: which part of the road matters to the requester.
    """

    vehicle: str
    ego: str
    interest: Interest

    def signals(self) -> tuple[str, ...]:
        """What has to be recorded."""
        names = ("id", "position", "heading", "size", "body", "lidar", "equipped")
        return (
            *(f"{self.vehicle}.{name}" for name in names),
            f"{self.ego}.id",
            f"{self.ego}.route",
        )


def truth_at(
    recording: Recording, source: Source, surroundings: Surroundings, time: Time
) -> Truth | None:
    """Find what is hidden from the requester at `time` [ns], and who reveals it.

    Candidates are the vehicles with lidar and radio that could see some of its area of interest.
    """
    scene = scene_at(recording, source, surroundings, time)
    return None if scene is None else find_truth(scene, source.interest)


def nearest_of(recording: Recording, source: Source, time: Time, candidates: list[int]) -> int:
    """The candidate nearest to the requester at `time` [ns]."""
    ids, position = (
        np.asarray(recording[f"{source.vehicle}.{name}"].at(time)) for name in ("id", "position")
    )
    place = {int(number): position[k, :2] for k, number in enumerate(ids.tolist())}
    own = place[_ego(recording, source, time)]
    return min(candidates, key=lambda one: float(np.linalg.norm(place[one] - own)))


def _ego(recording: Recording, source: Source, time: Time) -> int:
    return int(np.asarray(recording[f"{source.ego}.id"].at(time)))


def scene_at(
    recording: Recording, source: Source, surroundings: Surroundings, time: Time
) -> Scene | None:
    """What is near the requester at `time` [ns]; `None` if it is not there, or has no way or lidar.

    Buildings and vehicles that cannot hide anything of its area of interest from it or a candidate
    are left out.
    """
    now = {name.split(".")[-1]: recording[name].at(time) for name in source.signals()[:7]}
    ego, route = (
        _ego(recording, source, time),
        np.asarray(recording[f"{source.ego}.route"].at(time)),
    )
    ids = np.asarray(now["id"])
    rows = np.flatnonzero(ids == ego)
    if len(rows) == 0 or len(route) < 2 or not np.asarray(now["lidar"])[rows[0]]:
        return None
    position = np.asarray(now["position"])[:, :2]
    distance = np.linalg.norm(position - position[rows[0]], axis=1)
    reach = source.interest.horizon + REACH
    is_near = distance <= reach + REACH + _MARGIN
    is_candidate = np.asarray(now["lidar"]) & np.asarray(now["equipped"]) & (distance <= reach)
    order = [int(k) for k in np.argsort(ids) if is_near[k]]
    heading, size, body = (np.asarray(now[name]) for name in ("heading", "size", "body"))
    region = shapely.box(*(position[rows[0]] - reach), *(position[rows[0]] + reach))
    return Scene(
        road=shapely.intersection(surroundings.road, region),
        buildings=surroundings.near(position[rows[0]], reach + REACH),
        vehicles=[
            Vehicle(
                id=int(ids[k]),
                position=(float(position[k, 0]), float(position[k, 1])),
                heading=float(heading[k]),
                size=(float(size[k, 0]), float(size[k, 1]), float(size[k, 2])),
                body=int(body[k]),
            )
            for k in order
        ],
        ego=ego,
        candidates=[int(ids[k]) for k in order if is_candidate[k] and int(ids[k]) != ego],
        route=np.concatenate([position[rows[0]][None], route]),
        description=f"{time / 1e9:.2f} s",
    )
