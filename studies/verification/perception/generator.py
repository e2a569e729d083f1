"""Scenes from a seed: junctions and streets, houses, traffic, an ego vehicle, candidates."""

from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from shapely import STRtree
from shapely.geometry import Polygon

from studies.verification.perception.road import LANE_WIDTH, Arm, Road, draw_buildings, draw_road
from studies.verification.perception.scene import Float, Scene, Vehicle

FARTHEST: Final = 85.0
"""Vehicles stand and drive within this distance of the junction [m]."""
_CLEARANCE: Final = 0.4
"""Smallest distance of two vehicles [m]."""

_SIZES: Final = (
    ((4.1, 1.74, 1.42), (4.9, 1.88, 1.55)),
    ((4.3, 1.80, 1.60), (5.0, 1.98, 1.85)),
    ((4.9, 1.92, 1.95), (6.6, 2.05, 2.75)),
    ((10.5, 2.50, 2.95), (13.0, 2.55, 3.30)),
    ((7.5, 2.45, 3.20), (16.5, 2.55, 4.00)),
)
"""Smallest and largest length, width, height [m], by class: car, SUV, van, bus, truck."""
_MIX: Final = (0.50, 0.20, 0.12, 0.07, 0.11)


@dataclass(frozen=True, slots=True)
class Place:
    """Where a vehicle stands.

    Attributes:
        position: centre of the footprint [m].
        heading: counter-clockwise from east [rad].
    """

    position: tuple[float, float]
    heading: float


def draw_body(rng: np.random.Generator) -> tuple[int, tuple[float, float, float]]:
    """Draw class and size [m] of any vehicle."""
    body = int(rng.choice(5, p=_MIX))
    return body, draw_size(rng, body)


def draw_size(rng: np.random.Generator, body: int) -> tuple[float, float, float]:
    """Draw a size of a class: length, width, height [m]."""
    low, high = _SIZES[body]
    length, width, height = (float(rng.uniform(a, b)) for a, b in zip(low, high, strict=True))
    return length, width, height


class Traffic:
    """Collects vehicles, and refuses those that would overlap."""

    def __init__(self) -> None:
        self.vehicles: list[Vehicle] = []
        self._taken: list[Polygon] = []

    def add(self, place: Place, body: int, size: tuple[float, float, float]) -> bool:
        """Add a vehicle, if there is room for it, and say whether there was."""
        one = Vehicle(
            id=len(self.vehicles), position=place.position, heading=place.heading, size=size,
            body=body,
        )  # fmt: skip
        room = one.footprint.buffer(_CLEARANCE, join_style="mitre")
        if self._taken and len(STRtree(self._taken).query(room, predicate="intersects")):
            return False
        self.vehicles.append(one)
        self._taken.append(one.footprint)
        return True


def fill(rng: np.random.Generator, road: Road, traffic: Traffic) -> None:
    """Add vehicles to every lane: queues before stop lines, others on the move."""
    mean_gap = rng.uniform(12, 45)
    red = [road.is_junction and rng.random() < 0.6 for _ in range(2)]
    for k, arm in enumerate(road.arms):
        for lane in range(arm.lanes):
            start = road.stop + rng.uniform(0.5, 2)
            if red[k % 2]:
                start = _queue(rng, traffic, arm, lane, start)
            _flow(rng, traffic, arm, lane, start=start, mean_gap=mean_gap, is_inbound=True)
            _flow(rng, traffic, arm, lane, start=road.stop, mean_gap=mean_gap, is_inbound=False)
    if road.is_junction:
        _cross(rng, road, traffic)


def _queue(rng: np.random.Generator, traffic: Traffic, arm: Arm, lane: int, start: float) -> float:
    """Add up to seven vehicles behind the stop line, and say where the queue ends [m]."""
    for _ in range(int(rng.integers(0, 8))):
        body, size = draw_body(rng)
        if start + size[0] > FARTHEST:
            break
        traffic.add(_inbound(rng, arm, lane, start + size[0] / 2), body, size)
        start += size[0] + rng.uniform(1.2, 3)
    return start


def _flow(
    rng: np.random.Generator,
    traffic: Traffic,
    arm: Arm,
    lane: int,
    *,
    start: float,
    mean_gap: float,
    is_inbound: bool,
) -> None:
    """Add moving vehicles with exponentially distributed gaps of 5 m and more."""
    place = _inbound if is_inbound else _outbound
    while True:
        body, size = draw_body(rng)
        start += 5 + rng.exponential(mean_gap)
        if start + size[0] > FARTHEST:
            return
        traffic.add(place(rng, arm, lane, start + size[0] / 2), body, size)
        start += size[0]


def _cross(rng: np.random.Generator, road: Road, traffic: Traffic) -> None:
    """Add up to three vehicles on their way through the junction."""
    for _ in range(int(rng.integers(0, 4))):
        start, goal = (road.arms[int(k)] for k in rng.choice(len(road.arms), 2, replace=False))
        way = road.way(start, int(rng.integers(0, start.lanes)), goal, road.stop + 1)
        body, size = draw_body(rng)
        traffic.add(_along(way, rng.uniform(0.1, 0.9)), body, size)


def _along(way: Float, share: float) -> Place:
    """Find a place on the curve of a way, which is all but its first and last vertex."""
    curve = way[1:-1]
    k = min(int(share * (len(curve) - 1)), len(curve) - 2)
    step = curve[k + 1] - curve[k]
    x, y = curve[k] + (share * (len(curve) - 1) - k) * step
    return Place((float(x), float(y)), float(np.arctan2(step[1], step[0])))


def _inbound(rng: np.random.Generator, arm: Arm, lane: int, distance: float) -> Place:
    x, y = arm.inbound(distance, lane) + _sideways(rng, arm)
    return Place((float(x), float(y)), arm.heading + np.pi)


def _outbound(rng: np.random.Generator, arm: Arm, lane: int, distance: float) -> Place:
    x, y = arm.outbound(distance, lane) + _sideways(rng, arm)
    return Place((float(x), float(y)), arm.heading)


def _sideways(rng: np.random.Generator, arm: Arm) -> Float:
    """Draw an offset across the lane [m]: nobody drives exactly in the middle."""
    left = float(np.clip(rng.normal(0, 0.05), -0.1, 0.1)) * LANE_WIDTH
    return arm.at(0.0, left)


@dataclass(frozen=True, slots=True)
class Candidates:
    """How many candidates a scene has.

    Attributes:
        fewest: at least; scenes with fewer vehicles near are drawn again.
        most: what the number is drawn up to; it is lower if there are not so many vehicles near.
    """

    fewest: int
    most: int


FEW: Final = Candidates(2, 10)
"""The candidates as long as few vehicles are equipped."""
MANY: Final = Candidates(30, 50)
"""The candidates when almost all vehicles of dense traffic are equipped."""
NEAR: Final = 80.0
"""Largest distance of a candidate from the ego vehicle [m]."""
_HOUSES: Final = 0.8
"""Share of the scenes that have buildings."""


def draw_scene(seed: int, number: int, candidates: Candidates = FEW) -> Scene:
    """Draw a scene: the same for the same seed and number, whatever other scenes there are."""
    rng = np.random.default_rng([seed, number])
    while True:
        scene = _draw_any(rng, candidates)
        if len(scene.candidates) >= candidates.fewest:
            return scene


def _draw_any(rng: np.random.Generator, wanted: Candidates) -> Scene:
    road = draw_road(rng)
    buildings = draw_buildings(rng, road) if rng.random() < _HOUSES else ()
    traffic = Traffic()
    route, turn = _draw_ego(rng, road, traffic)
    fill(rng, road, traffic)
    vehicles, ego = _number(rng, traffic.vehicles)
    candidates = _draw_candidates(rng, vehicles, ego, wanted)
    lanes = "+".join(str(arm.lanes) for arm in road.arms)
    return Scene(
        road=road.surface,
        buildings=buildings,
        vehicles=vehicles,
        ego=ego,
        candidates=candidates,
        route=route,
        description=f"{len(road.arms)} arms, {lanes} lanes, {turn}",
    )


def _draw_ego(rng: np.random.Generator, road: Road, traffic: Traffic) -> tuple[Float, str]:
    """Add the ego vehicle, a car or SUV that approaches: its route [m], and where it turns."""
    first, second = (int(k) for k in rng.choice(len(road.arms), 2, replace=False))
    start, goal = road.arms[first], road.arms[second]
    lane = int(rng.integers(0, start.lanes))
    distance = road.stop + rng.uniform(4, 40)
    way = road.way(start, lane, goal, distance)
    body = int(rng.integers(0, 2))
    x, y = (float(value) for value in way[0])
    traffic.add(Place((x, y), start.heading + np.pi), body, draw_size(rng, body))
    return way, _turn(start, goal)


def _turn(start: Arm, goal: Arm) -> str:
    angle = (goal.heading - start.heading - np.pi + np.pi) % (2 * np.pi) - np.pi
    if abs(angle) < np.pi / 4:
        return "straight on"
    return "left" if angle > 0 else "right"


def _number(rng: np.random.Generator, vehicles: list[Vehicle]) -> tuple[tuple[Vehicle, ...], int]:
    """Put vehicles into a random order, so that an id tells nothing; also the ego vehicle's id."""
    ids = rng.permutation(len(vehicles))
    shuffled = [replace(one, id=int(k)) for one, k in zip(vehicles, ids, strict=True)]
    return tuple(sorted(shuffled, key=lambda one: one.id)), int(ids[0])


def _draw_candidates(
    rng: np.random.Generator, vehicles: tuple[Vehicle, ...], ego: int, wanted: Candidates
) -> tuple[int, ...]:
    center = np.array(vehicles[ego].position)
    near = [
        one.id
        for one in vehicles
        if one.id != ego and np.linalg.norm(np.array(one.position) - center) <= NEAR
    ]
    count = min(int(rng.integers(wanted.fewest, wanted.most + 1)), len(near))
    return tuple(sorted(int(k) for k in rng.choice(near, count, replace=False)))
