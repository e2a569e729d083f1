"""Scenes as inputs, scans of them by both lidars, and what differs between two scans."""

import math
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from fmus.lidar.gpu import LidarTorch
from fmus.lidar.gpu.connectors import CONNECTORS
from fmus.messages.bodies import Body
from fmus.messages.records import POINT, SENSOR, unframe
from orchestrator import registry
from orchestrator.component import Component
from orchestrator.signal import Array, Signals
from tests.fmus.scene import SIZES, Building, Scene, Vehicle

NO_NOISE: Final = {"range_noise": 0.0, "dropout": 0.0}
SHAPES: Final = (
    ((-1, -1), (1, -1), (1, 1), (-1, 1)),
    ((-1, -1), (1, -1), (1, 0), (0, 0), (0, 1), (-1, 1)),  # L
    ((-1, -1), (1, -1), (1, 1), (0.6, 1), (0.6, -0.5), (-0.6, -0.5), (-0.6, 1), (-1, 1)),  # U
    ((-1, -1), (0.2, -0.1), (1, -1), (0.1, 0.2), (0, 1), (-0.1, 0.2)),  # a star
    ((-1, -1), (1, 1), (1, -1), (-1, 1)),  # crosses itself
    tuple((math.cos(k * math.pi / 8), math.sin(k * math.pi / 8)) for k in range(16)),
)


def inputs(scene: Scene) -> Signals:
    """The inputs of both lidars."""
    cars, houses = scene.vehicles, scene.buildings
    values: dict[str, Any] = {
        "vehicle.id": [v.id for v in cars],
        "vehicle.position": [v.position for v in cars],
        "vehicle.heading": [v.heading for v in cars],
        "vehicle.size": [v.size for v in cars],
        "vehicle.body": [v.body for v in cars],
        "vehicle.lidar": [v.lidar for v in cars],
        "building.vertex": [corner for house in houses for corner in house.ring],
        "building.index": [k for k, house in enumerate(houses) for _ in house.ring],
        "building.height": [house.height for house in houses],
    }
    return {name: _as_declared(name, value) for name, value in values.items()}


def _as_declared(name: str, value: Any) -> Array:
    lengths = (-1, *CONNECTORS[name].shape[1:])
    return np.array(value, CONNECTORS[name].dtype).reshape(lengths)  # type: ignore[arg-type]


def create(kind: str, **parameters: Any) -> Component:
    """A lidar of either kind: `lidar` or `lidar-torch`."""
    if kind == "lidar":
        return registry.component_type("lidar").create("lidar", parameters)
    return LidarTorch(LidarTorch.Parameters(**parameters))


def scan(kind: str, scene: Scene, **parameters: Any) -> bytes:
    """The `points` of one scan at t = 0, with a seed drawn from equal streams."""
    lidar = create(kind, **parameters)
    lidar.setup(0, np.random.default_rng(7))
    try:
        lidar.initialise(inputs(scene))
        return bytes(lidar.outputs()["points"])
    finally:
        lidar.close()


def points_of(data: bytes) -> Array:
    """The points of all sensors."""
    sensors = unframe("LPTS", data, SENSOR)
    found: Array = np.frombuffer(data, POINT, -1, 16 + sensors.nbytes)
    assert sensors["count"].sum() == len(found)
    assert (np.cumsum(sensors["count"]) - sensors["count"] == sensors["first"]).all()
    return found


@dataclass(frozen=True, slots=True, kw_only=True)
class Comparison:
    """Two clouds, ray by ray.

    Attributes:
        rays: of all sensors together.
        exceptions: rays that hit in one cloud only, or another instance.
        hits: rays that hit the same in both.
        position: the largest difference of a coordinate of these [m].
        intensity: and of an intensity.
    """

    rays: int
    exceptions: int
    hits: int
    position: float
    intensity: float


def compare(a: bytes, b: bytes, *, azimuths: int, top: float, bottom: float) -> Comparison:
    """Compare two scans of 64 channels; the records of the sensors must agree."""
    first, second = unframe("LPTS", a, SENSOR), unframe("LPTS", b, SENSOR)
    for field in ("vehicle", "time", "position", "heading", "pitch", "roll"):
        np.testing.assert_array_equal(first[field], second[field])
    clouds = [
        _image(points_of(data), sensors["count"], azimuths, top, bottom)
        for data, sensors in ((a, first), (b, second))
    ]
    (one, is_one), (two, is_two) = clouds
    same = is_one & is_two & (one["instance"] == two["instance"])
    return Comparison(
        rays=len(one),
        exceptions=int((is_one | is_two).sum() - same.sum()),
        hits=int(same.sum()),
        position=float(np.abs(one["position"] - two["position"])[same].max()),
        intensity=float(np.abs(one["intensity"] - two["intensity"])[same].max()),
    )


def _image(
    points: Array, count: Array, azimuths: int, top: float, bottom: float
) -> tuple[Array, Array]:
    """The point of each ray, and whether there is one; no point may be at the sensor itself."""
    x, y, z = points["position"].astype(float).T
    azimuth = np.round(np.arctan2(y, x) / (2 * np.pi / azimuths)).astype(int) % azimuths
    channel = np.round((np.arctan2(z, np.hypot(x, y)) - top) / ((bottom - top) / 63)).astype(int)
    sensor = np.repeat(np.arange(len(count)), count)
    ray = (sensor * azimuths + azimuth) * 64 + channel
    assert (np.diff(ray) > 0).all(), "points are in the order of sensor, azimuth, channel"
    image = np.zeros(len(count) * azimuths * 64, POINT)
    image[ray] = points
    is_hit = np.zeros(len(image), np.bool_)
    is_hit[ray] = True
    return image, is_hit


def town(seed: int, *, vehicles: int, buildings: int, sensors: int, heights: list[float]) -> Scene:
    """A random scene within 70 m: all bodies, overlapping, on the ground and over it."""
    rng = np.random.default_rng(seed)
    cars = []
    for k in range(vehicles):
        body = Body(int(rng.integers(len(Body))))
        length, width, height = SIZES[body]
        x, y = rng.uniform(-45, 45, 2)
        cars.append(
            Vehicle(
                id=10 * k + int(rng.integers(10)),
                position=(float(x), float(y), float(rng.choice([0.0, 0.0, 0.0, 0.7, 6.0]))),
                heading=float(rng.uniform(-7, 7)),
                size=(
                    length,
                    width * float(rng.uniform(0.9, 1.1)),
                    height * float(rng.uniform(0.9, 1.1)),
                ),
                body=body,
                lidar=k < sensors,
            )
        )
    houses = []
    for _ in range(buildings):
        angle, turn = rng.uniform(0, 2 * np.pi, 2)
        shape = np.array(SHAPES[rng.integers(len(SHAPES))]) * rng.uniform(3, 15, 2)
        c, s = np.cos(turn), np.sin(turn)
        center = rng.uniform(3, 65) * np.array([np.cos(angle), np.sin(angle)])
        ring = (shape @ np.array([[c, s], [-s, c]]) + center)[:: rng.choice([-1, 1])]
        corners = tuple((float(x), float(y)) for x, y in ring)
        height = float(rng.choice(heights) * rng.uniform(0.9, 1.1))
        houses.append(Building(ring=corners, height=height))
    return Scene(vehicles=cars, buildings=houses)
