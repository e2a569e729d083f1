"""Vehicles, buildings and roads as inputs that a unit may get."""

from collections.abc import Mapping
from typing import Final

import numpy as np

from orchestrator.signal import Array
from tests.reliability.episodes.calls import Table
from tests.reliability.episodes.values import HOSTILE, coordinates, valid

FARTHEST: Final = 1e8
"""Coordinates that all units accept [m]."""

_COUNTS: Final = (0, 1, 1, 2, 3, 5, 12, 40)
_RINGS: Final = (0, 1, 1, 2, 5)
_BODIES: Final = 9
_LARGEST_ID: Final = 2**31 - 1


def ids(rng: np.random.Generator, count: int) -> Array:
    """Numbers of vehicles, ascending, int64, shape (count,)."""
    last = rng.choice((count, 3 * count + 1, _LARGEST_ID + 1))
    return np.sort(rng.choice(last, count, replace=False)) if last < 10**6 else np.unique(
        np.append(rng.integers(0, _LARGEST_ID, max(count - 1, 0)), [_LARGEST_ID] * (count > 0))
    ).astype(np.int64)  # fmt: skip


def _vehicles(rng: np.random.Generator) -> dict[str, Array]:
    number = ids(rng, int(rng.choice(_COUNTS)))
    count = len(number)
    heading = rng.choice((1.0, 7.0, 1e6)) * rng.uniform(-1, 1, count)
    low, high = (-0.5, 1.2) if rng.random() < 0.8 else (-12.0, 4.0)
    size = 10 ** rng.uniform(low, high, (count, 3))
    return {
        "vehicle.id": number,
        "vehicle.position": coordinates(rng, count, 3, FARTHEST),
        "vehicle.heading": heading,
        "vehicle.size": size,
        "vehicle.body": rng.integers(0, _BODIES, count),
        "vehicle.antenna_height": rng.choice((0.0, 1.5, 1e-9, 1e4)) * rng.uniform(0, 1, count),
        "vehicle.equipped": rng.random(count) < rng.choice((0.0, 0.7, 1.0)),
        "vehicle.lidar": rng.random(count) < rng.choice((0.1, 0.5, 1.0)),
    }


def _ring(rng: np.random.Generator) -> Array:
    """Corners of a polygon: upright, any, crossing itself, without area; shape (corner, 2)."""
    corners = int(rng.choice((3, 4, 4, 7, 60)))
    match rng.integers(0, 4):
        case 0:
            x, y = rng.uniform(-200, 200, 2)
            w, h = rng.uniform(0, 60, 2)
            found = np.array([(x, y), (x + w, y), (x + w, y + h), (x, y + h)])
        case 1:
            angle = np.sort(rng.uniform(0, 2 * np.pi, corners))
            radius = rng.uniform(1, 80)
            centre = rng.uniform(-200, 200, 2)
            found = centre + radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)
        case _:
            found = coordinates(rng, corners, 2, FARTHEST)
    clipped: Array = np.clip(found, -FARTHEST, FARTHEST)
    return clipped


def _rings(rng: np.random.Generator) -> tuple[Array, Array, int]:
    """Corners, shape (corner, 2), the ring of each, shape (corner,), and how many rings."""
    rings = [_ring(rng) for _ in range(int(rng.choice(_RINGS)))]
    vertex = np.concatenate([np.zeros((0, 2)), *rings])
    index = np.repeat(np.arange(len(rings)), [len(ring) for ring in rings])
    return vertex, index, len(rings)


def any_scene(rng: np.random.Generator, table: Table) -> dict[str, Array]:
    """Inputs of the scene that the unit has, and the structural parameters that fit, by name."""
    values = _vehicles(rng)
    walls, wall_of, buildings = _rings(rng)
    road, road_of, _ = _rings(rng)
    route = coordinates(rng, int(rng.choice((0, 1, 2, 9))), 2, FARTHEST)
    values |= {
        "building.vertex": walls,
        "building.index": wall_of,
        "building.height": 10 ** rng.uniform(-6, 4, buildings),
        "road.vertex": road,
        "road.index": road_of,
        "route.vertex": route,
    }
    sizes: dict[str, Array] = {
        "n_vehicle": np.array(len(values["vehicle.id"])),
        "n_building_vertex": np.array(len(walls)),
        "n_building": np.array(buildings),
        "n_road_vertex": np.array(len(road)),
        "n_route_vertex": np.array(len(route)),
    }
    values |= _probes(rng, values["vehicle.id"]) if "n_probe" in table.variables else {}
    for name in ("n_blind_zone", "n_sharer"):
        if name in table.variables:
            sizes[name] = valid(rng, table.variables[name])
    sizes["n_probe"] = np.array(len(values.get("probe.size", [])))
    return {name: v for name, v in (sizes | values).items() if name in table.variables}


def _probes(rng: np.random.Generator, numbers: Array) -> dict[str, Array]:
    count = int(rng.choice((0, 1, 4)))
    carriers = np.append(numbers, -1)
    return {
        "probe.transmitter": coordinates(rng, count, 3, FARTHEST),
        "probe.receiver": coordinates(rng, count, 3, FARTHEST),
        "probe.carrier": rng.choice(carriers, (count, 2)),
        "probe.size": rng.integers(0, 3000, count),
    }


def spoilt(rng: np.random.Generator, values: Mapping[str, Array]) -> dict[str, Array]:
    """The same with an element or two that are hostile, or with an array of another length."""
    found = dict(values)
    names = [name for name, value in found.items() if np.size(value)]
    for name in rng.choice(names, min(len(names), int(rng.integers(1, 3))), replace=False):
        value = np.array(found[name], np.float64)
        flat = value.reshape(-1)
        flat[rng.integers(0, len(flat))] = rng.choice(HOSTILE)
        found[name] = value if rng.random() < 0.8 else flat[: rng.integers(0, len(flat) + 1)]
    return found
