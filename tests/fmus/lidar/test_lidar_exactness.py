"""The raster hits what brute force hits, at the same distance."""

import math
from dataclasses import dataclass

import numpy as np
import pytest

from fmus.records import BUILDING
from tests.fmus.scene import Building, Scene, Vehicle

from .brute_force import NOTHING, Float, cast, rotation
from .harness import NO_NOISE, Cloud, Scan

RAYS = 64 * 256
SHAPES = (
    ((-1, -1), (1, -1), (1, 1), (-1, 1)),
    ((-1, -1), (1, -1), (1, 0), (0, 0), (0, 1), (-1, 1)),  # L
    ((-1, -1), (1, -1), (1, 1), (0.6, 1), (0.6, -0.5), (-0.6, -0.5), (-0.6, 1), (-1, 1)),  # U
    tuple((math.cos(k * math.pi / 4), math.sin(k * math.pi / 4)) for k in range(8)),
    ((-1, -1), (0.2, -0.1), (1, -1), (0.1, 0.2), (0, 1), (-0.1, 0.2)),  # a star
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Pattern:
    """The scan pattern and the tilt of the sensor; angles in rad."""

    top: float = math.radians(4)
    bottom: float = math.radians(-20)
    pitch: float = 0.0
    roll: float = 0.0
    reach: float = 60.0

    def parameters(self) -> dict[str, float]:
        """The FMU's parameters."""
        return NO_NOISE | {
            "channels": 64,
            "azimuths": 256,
            "elevation_top": self.top,
            "elevation_bottom": self.bottom,
            "pitch": self.pitch,
            "roll": self.roll,
            "range": self.reach,
        }

    def directions(self) -> Float:
        """Unit vectors in the sensor frame, shape (256, 64, 3)."""
        azimuth = np.arange(256)[:, None] * (2 * np.pi / 256)
        elevation = np.linspace(self.top, self.bottom, 64)[None, :]
        x, y = np.cos(azimuth) * np.cos(elevation), np.sin(azimuth) * np.cos(elevation)
        return np.stack([x, y, np.broadcast_to(np.sin(elevation), x.shape)], axis=-1)


def town(rng: np.random.Generator, vehicles: int, buildings: int, heights: Float) -> Scene:
    """A random scene within 80 m; the vehicle in the middle carries the sensor.

    Bodies and buildings may overlap, but no two faces coincide: which of them a ray hits first
    would be undefined.
    """
    cars = []
    for k in range(vehicles):
        body = int(rng.integers(5))
        length, height = ((4.5, 1.5), (4.7, 1.8), (5.9, 2.5), (12.0, 3.2), (10.0, 3.8))[body]
        position = rng.uniform(-50, 50, 2) if k else np.zeros(2)
        ground = float(rng.choice([0.0, 0.0, 0.0, 0.7, 5.0])) if k else 0.0
        cars.append(
            Vehicle(
                id=10 * k + int(rng.integers(10)),
                position=(float(position[0]), float(position[1]), ground),
                heading=float(rng.uniform(-7, 7)),
                size=(length, float(rng.uniform(1.6, 2.6)), height * float(rng.uniform(0.9, 1.1))),
                body=body,
                lidar=k == 0,
            )
        )
    houses = []
    for _ in range(buildings):
        angle, turn = rng.uniform(0, 2 * np.pi, 2)
        center = rng.uniform(8, 70) * np.array([np.cos(angle), np.sin(angle)])
        shape = np.array(SHAPES[rng.integers(len(SHAPES))]) * rng.uniform(3, 15, 2)
        ring = shape @ rotation(turn, 0, 0)[:2, :2].T + center
        ring = ring[:: rng.choice([-1, 1])]
        corners = tuple((float(x), float(y)) for x, y in ring)
        houses.append(
            Building(ring=corners, height=float(rng.choice(heights) * rng.uniform(0.9, 1.1)))
        )
    return Scene(vehicles=cars, buildings=houses)


def as_image(cloud: Cloud, pattern: Pattern) -> tuple[Float, np.ndarray]:
    """Distance and instance per ray, from the directions of the points."""
    position = cloud.points["position"].astype(float)
    r = np.linalg.norm(position, axis=1)
    azimuth = np.round(np.arctan2(position[:, 1], position[:, 0]) / (2 * np.pi / 256)).astype(int)
    elevation = np.arcsin(position[:, 2] / r)
    step = (pattern.bottom - pattern.top) / 63
    ray = azimuth % 256 * 64 + np.round((elevation - pattern.top) / step).astype(int)
    assert (np.diff(ray) > 0).all(), "points are in the order of azimuth, then channel"
    distance, instance = np.full(RAYS, np.inf), np.full(RAYS, NOTHING)
    distance[ray], instance[ray] = r, cloud.points["instance"]
    return distance, instance


LEVEL = Pattern()
CASES = [
    (LEVEL, 40, 12, [12.0, 25.0]),
    (LEVEL, 120, 20, [1.0, 3.0, 12.0]),
    (LEVEL, 0, 30, [0.5, 1.0, 1.5]),
    (Pattern(top=1.2, bottom=-1.2, reach=45.0), 60, 10, [2.0, 20.0]),
    (Pattern(top=0.3, bottom=-0.5, reach=200.0), 30, 40, [3.0, 40.0]),
    (Pattern(pitch=0.05), 60, 12, [1.5, 15.0]),
    (Pattern(pitch=-0.1, roll=0.2), 60, 12, [1.5, 15.0]),
    (Pattern(top=1.3, bottom=-1.3, pitch=1.0, roll=-0.7), 80, 10, [1.0, 8.0]),
]


@pytest.mark.parametrize("case", range(len(CASES)))
def test_every_ray_hits_what_brute_force_hits(scan: Scan, case: int) -> None:
    pattern, vehicles, buildings, heights = CASES[case]
    scene = town(np.random.default_rng(case), max(vehicles, 1), buildings, np.array(heights))
    ((own, cloud),) = scan(scene, **pattern.parameters()).items()
    turn = rotation(float(cloud.sensor["heading"]), pattern.pitch, pattern.roll)
    world = pattern.directions().reshape(-1, 3) @ turn.T
    expected, name = cast(scene, own, cloud.sensor["position"], world, pattern.reach)
    distance, instance = as_image(cloud, pattern)
    wrong = instance != name
    # 131,072 rays in all cases together: one edge-grazing ray would be 1 in 1e5, here none
    assert wrong.sum() == 0, f"rays {np.flatnonzero(wrong)[:9]}"
    hit = np.isfinite(expected)
    np.testing.assert_allclose(distance[hit], expected[hit], rtol=0, atol=1e-4)
    assert (instance <= BUILDING).sum() > 100, "the scene is worth testing"
    assert (instance >= 0).sum() > (20 if vehicles else -1)
