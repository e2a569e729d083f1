"""Clouds with known contents, and a planar lidar that knows what hides what."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from fmus.messages.apm import Float
from fmus.messages.records import GROUND, POINT, SENSOR, frame
from orchestrator.signal import Array

SENSOR_HEIGHT: Final = 2.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Scan:
    """What one sensor sees, in world coordinates.

    Attributes:
        vehicle: the carrier.
        points: world frame [m], shape (point, 3).
        instances: labels, shape (point,) or one for all.
        time: of the scan [ns].
        position: of the sensor [m].
        heading, pitch, roll: of the sensor [rad].
    """

    vehicle: int
    points: Float
    instances: Array | int = GROUND
    time: int = 0
    position: tuple[float, float, float] = (0.0, 0.0, SENSOR_HEIGHT)
    heading: float = 0.0
    pitch: float = 0.0
    roll: float = 0.0

    def rotation(self) -> Float:
        """World frame <- sensor frame: roll about x, then pitch about y, then heading about z."""
        c, s = np.cos(self.heading), np.sin(self.heading)
        cp, sp = np.cos(self.pitch), np.sin(self.pitch)
        cr, sr = np.cos(self.roll), np.sin(self.roll)
        turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
        nod = np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
        lean = np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
        product: Float = turn @ nod @ lean
        return product

    def records(self) -> Array:
        """The points as POINT records."""
        records = np.zeros(len(self.points), POINT)
        records["position"] = (self.points - np.array(self.position)) @ self.rotation()
        records["instance"] = self.instances
        return records


def cloud(*scans: Scan) -> bytes:
    """The scans as one "LPTS" signal."""
    sensors, first = np.zeros(len(scans), SENSOR), 0
    for record, scan in zip(sensors, scans, strict=True):
        record["vehicle"], record["time"] = scan.vehicle, scan.time
        record["position"], record["heading"] = scan.position, scan.heading
        record["pitch"], record["roll"] = scan.pitch, scan.roll
        record["first"], record["count"] = first, len(scan.points)
        first += len(scan.points)
    return frame("LPTS", sensors, b"".join(scan.records().tobytes() for scan in scans))


def ground(low: float, high: float, spacing: float = 1.0) -> Float:
    """A carpet of ground points over [low, high] in x and y, shape (point, 3)."""
    line = np.arange(low + spacing / 2, high, spacing)
    x, y = np.meshgrid(line, line)
    return np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=-1)


@dataclass(frozen=True, slots=True, kw_only=True)
class Box:
    """An upright box.

    Attributes:
        instance: its label.
        low, high: corners of the footprint, world frame [m].
        height: [m].
    """

    instance: int
    low: tuple[float, float]
    high: tuple[float, float]
    height: float = 1.5


def car(instance: int, x: float, y: float, *, length: float = 4.5, height: float = 1.5) -> Box:
    """A box of `length` x 1.8 m along x, centred on (x, y)."""
    low, high = (x - length / 2, y - 0.9), (x + length / 2, y + 0.9)
    return Box(instance=instance, low=low, high=high, height=height)


def look(vehicle: int, origin: tuple[float, float], boxes: Sequence[Box], time: int = 0) -> Scan:
    """A scan of boxes by 1,800 rays in the horizontal plane, each hit at five heights.

    The first box on a ray hides what is behind it, whatever the heights.
    """
    azimuth = np.arange(1800) * (2 * np.pi / 1800)
    direction = np.stack([np.cos(azimuth), np.sin(azimuth)], axis=-1)
    nearest, hit = np.full(len(azimuth), 60.0), np.full(len(azimuth), -1)
    for index, box in enumerate(boxes):
        with np.errstate(divide="ignore", invalid="ignore"):
            sides = (np.array([box.low, box.high])[:, None] - np.array(origin)) / direction
        entry, leave = sides.min(axis=0).max(axis=-1), sides.max(axis=0).min(axis=-1)
        found = (entry > 0) & (entry < leave) & (entry < nearest)
        nearest[found], hit[found] = entry[found], index
    rays = np.flatnonzero(hit >= 0)
    plane = np.array(origin) + nearest[rays, None] * direction[rays]
    heights = np.array([box.height for box in boxes])[hit[rays]]
    labels = np.array([box.instance for box in boxes])[hit[rays]]
    levels = np.array([0.1, 0.3, 0.5, 0.75, 1.0])
    points = np.concatenate(
        [np.column_stack([plane, level * heights]) for level in levels]
    ).reshape(-1, 3)
    return Scan(
        vehicle=vehicle,
        points=points,
        instances=np.tile(labels, len(levels)),
        time=time,
        position=(*origin, SENSOR_HEIGHT),
    )
