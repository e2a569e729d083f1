"""Scenes from a seed: junctions and streets, houses, traffic, an ego vehicle, candidates."""

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from studies.verification.perception.houses import draw_buildings
from studies.verification.perception.road import Arm, Road, draw_road
from studies.verification.perception.scene import Float, Scene, Vehicle
from studies.verification.perception.traffic import Place, Traffic, draw_size, fill


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
"""As long as few vehicles are equipped."""
MANY: Final = Candidates(30, 50)
"""When almost all vehicles of dense traffic are."""
NEAR: Final = 80.0
"""Largest distance of a candidate from the ego vehicle [m]."""
_HOUSES: Final = 0.8
"""Share of the scenes that have buildings."""


def draw_scene(seed: int, number: int, candidates: Candidates = FEW) -> Scene:
    """One scene; the same for the same seed and number, whatever other scenes there are."""
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
    """Add the ego vehicle, a car or SUV that approaches; its route, and where it turns."""
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
    """The vehicles in a random order, so that an id tells nothing; and the ego vehicle's id."""
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
