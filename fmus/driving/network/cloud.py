"""The points of one turn of a lidar, with z straight up."""

from dataclasses import dataclass

import numpy as np

from fmus.messages.records import FRAME, POINT, SENSOR, unframe
from fmus.physics.plane import Frame, turned
from orchestrator.signal import Array
from orchestrator.timebase import Time


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class OfLidar:
    """Something that a lidar saw in one turn, in its levelled frame.

    Attributes:
        vehicle: that carries the lidar.
        time: of the scan [ns].
        frame: place and heading of the sensor.
        height: of the sensor over the ground [m].
    """

    vehicle: int
    time: Time
    frame: Frame
    height: float


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Cloud(OfLidar):
    """What a lidar measured: x along the heading, y left, z up.

    Attributes:
        x, y, z: from the sensor [m], float32, shape (point,).
    """

    x: Array
    y: Array
    z: Array


def clouds(points: bytes) -> list[Cloud]:
    """The scans in a `points` signal, by sensor.

    Raises:
        ValueError: it is no such signal, or is cut short.
    """
    sensors = unframe("LPTS", points, SENSOR)
    begin = FRAME.itemsize + sensors.nbytes
    total = int(sensors["count"].sum())
    if len(points) < begin + total * POINT.itemsize and points:
        raise ValueError(f"`points` announces {total} points and is cut short")
    numbers = np.frombuffer(points, "<f4", total * POINT.itemsize // 4, begin if points else 0)
    rows = numbers.reshape(total, POINT.itemsize // 4)
    for sensor in sensors:
        if int(sensor["first"]) + int(sensor["count"]) > total:
            raise ValueError(
                f"`points` has {total} points, and those of vehicle {sensor['vehicle']} are "
                f"{sensor['count']} from number {sensor['first']} on"
            )
    return [_cloud(sensor, rows) for sensor in sensors]


def _cloud(sensor: np.void, numbers: Array) -> Cloud:
    """The cloud of a SENSOR record; `numbers` has all POINT records, float32, (point, 5)."""
    first = int(sensor["first"])
    x, y, z = numbers[first : first + int(sensor["count"]), :3].T
    if sensor["pitch"] or sensor["roll"]:
        # level = Ry(pitch) Rx(roll) sensor, as docs/physics-lidar.md has it
        y, z = turned(y, z, float(sensor["roll"]))  # right side down positive: about x
        z, x = turned(z, x, float(sensor["pitch"]))  # nose down positive: about y
    return Cloud(
        vehicle=int(sensor["vehicle"]),
        time=int(sensor["time"]),
        frame=Frame.at(sensor["position"], float(sensor["heading"])),
        height=float(sensor["position"][2]),
        x=x,
        y=y,
        z=z,
    )
