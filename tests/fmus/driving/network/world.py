"""A small world for driving networks: scans of boxes and walls, and networks of random weights."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np

from fmus.driving.network.architecture import Architecture
from fmus.driving.network.checkpoint import Checkpoint
from fmus.driving.network.cloud import Cloud
from fmus.driving.network.scan import Scan, scan_of
from fmus.messages.records import GROUND, POINT, SENSOR, frame
from fmus.physics.plane import Frame
from orchestrator.signal import Array

SMALL: Final = Architecture(
    keypoints=8, features=12, vectors=4, hidden=16, fused=16, pooled=24, head=10
)
"""A cooperative network that is quick to calculate."""
PERIOD: Final = 100_000_000
"""Of the lidars [ns]."""
HEIGHT: Final = 2.0
"""Of the sensors over the ground [m]."""


def network(architecture: Architecture = SMALL, seed: int = 0) -> Checkpoint:
    """Random weights, of a size with which activations, and the command, are of the order of 1."""
    rng = np.random.default_rng(seed)
    weights = {
        name: rng.normal(size=shape) * (0.3 if len(shape) == 1 else 1.2 / math.sqrt(shape[0]))
        for name, shape in architecture.shapes.items()
    }
    weights["head.second.weight"] *= 0.3
    weights["head.second.bias"] += 0.3
    return Checkpoint(architecture=architecture, weights=weights, origin={"seed": str(seed)})


def changed(architecture: Architecture = SMALL, **sizes: Any) -> Architecture:
    """An architecture with other sizes."""
    return replace(architecture, **sizes)


@dataclass(frozen=True, slots=True, kw_only=True)
class Sensor:
    """One lidar and what it saw.

    Attributes:
        points: in the sensor's frame, tilt included [m], shape (point, 3).
    """

    vehicle: int
    points: Array
    time: int = 0
    position: tuple[float, float, float] = (0.0, 0.0, HEIGHT)
    heading: float = 0.0
    pitch: float = 0.0
    roll: float = 0.0


def points_signal(*sensors: Sensor, intensity: float = 0.5, instance: int = GROUND) -> bytes:
    """As the lidar writes it."""
    rows = np.zeros(len(sensors), SENSOR)
    first = 0
    for row, sensor in zip(rows, sensors, strict=True):
        for name in ("vehicle", "time", "position", "heading", "pitch", "roll"):
            row[name] = getattr(sensor, name)
        row["first"], row["count"] = first, len(sensor.points)
        first += len(sensor.points)
    points = np.zeros(first, POINT)
    points["position"] = np.concatenate([sensor.points for sensor in sensors])
    points["intensity"], points["instance"] = intensity, instance
    return frame("LPTS", rows, points.tobytes())


def turn(k: int, places: Mapping[int, tuple[float, float]], *, alike: bool = False) -> bytes:
    """The scans of vehicles at the time number `k`, while a vehicle of the street moves.

    Args:
        k: counts the periods.
        places: of the sensors, by vehicle [m].
        alike: whether all see the same points rather than each a street of its own.
    """
    sensors = (
        Sensor(
            vehicle=vehicle,
            points=street(0 if alike else vehicle, moved=0.4 * k) - (x, y, HEIGHT),
            time=k * PERIOD,
            position=(x, y, HEIGHT),
        )
        for vehicle, (x, y) in places.items()
    )
    return points_signal(*sensors)


def seen_from(position: tuple[float, float], heading: float, world: Array, **others: Any) -> Cloud:
    """The points `world` [m], shape (point, 3), all of which a sensor there sees."""
    x, y = world[:, 0] - position[0], world[:, 1] - position[1]
    cosine, sine = math.cos(heading), math.sin(heading)
    return Cloud(
        vehicle=others.get("vehicle", 1),
        time=others.get("time", 0),
        frame=Frame(x=position[0], y=position[1], heading=heading),
        height=HEIGHT,
        x=(x * cosine + y * sine).astype(np.float32),
        y=(y * cosine - x * sine).astype(np.float32),
        z=(world[:, 2] - HEIGHT).astype(np.float32),
    )


def box(
    center: tuple[float, float], size: tuple[float, float] = (4.4, 1.8), top: float = 1.5
) -> Array:
    """Points all over an upright box, every 0.2 m; shape (point, 3)."""
    x, y, z = np.meshgrid(
        np.arange(0.1, size[0], 0.2) - size[0] / 2 + center[0],
        np.arange(0.1, size[1], 0.2) - size[1] / 2 + center[1],
        np.arange(0.4, top + 0.01, 0.35),
    )
    return np.stack([x.ravel(), y.ravel(), z.ravel()], axis=1)


def street(seed: int = 0, moved: float = 0.0) -> Array:
    """A wall beside a street with three vehicles on it, one of which has `moved` [m]."""
    rng = np.random.default_rng(seed)
    wall = np.stack(
        [
            rng.uniform(-40, 40, 4000),
            np.full(4000, 11.0) + rng.normal(0, 0.02, 4000),
            rng.uniform(0, 6, 4000),
        ],
        axis=1,
    )
    vehicles = [
        box((12.0, 3.4)),
        box((20.0, -3.3), (9.0, 2.4), 3.4),
        box((25.0 - moved, 0.4)),
    ]
    return np.concatenate([wall, *vehicles])


def scans(clouds: Sequence[Cloud]) -> list[Scan]:
    """Of clouds."""
    return [scan_of(cloud) for cloud in clouds]
