"""Every ray against every face, in the world frame and float64: the reference of exactness."""

from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from fmus.messages.records import BUILDING, GROUND
from tests.fmus.scene import Scene, Vehicle

Float = npt.NDArray[np.float64]
NOTHING: Final = -(2**31)
TOUCHING: Final = 1e-9
"""A sensor nearer to a face than this [m] does not see it."""

# docs/physics-lidar.md: rear, front (of the length), width, bottom, top (of the height)
PARTS: Final[tuple[tuple[tuple[float, float, float, float, float], ...], ...]] = (
    ((-0.50, 0.50, 1.00, 0.00, 0.62), (-0.36, 0.16, 0.85, 0.62, 1.00)),
    ((-0.50, 0.50, 1.00, 0.00, 0.62), (-0.48, 0.20, 0.88, 0.62, 1.00)),
    ((-0.50, 0.50, 1.00, 0.00, 0.50), (-0.50, 0.36, 1.00, 0.50, 1.00)),
    ((-0.50, 0.50, 1.00, 0.00, 1.00),),
    (
        (-0.50, 0.50, 1.00, 0.00, 0.30),
        (0.28, 0.50, 1.00, 0.30, 0.90),
        (-0.50, 0.24, 1.00, 0.30, 1.00),
    ),
    (
        (-0.49, 0.49, 0.85, 0.00, 0.12),
        (-0.50, 0.50, 1.00, 0.12, 0.88),
        (-0.45, 0.45, 0.70, 0.88, 1.00),
    ),
    (
        (-0.50, 0.50, 0.35, 0.00, 0.53),
        (-0.15, 0.15, 0.65, 0.18, 0.53),
        (-0.20, 0.18, 0.60, 0.53, 0.83),
        (-0.02, 0.12, 0.28, 0.83, 1.00),
    ),
    (
        (-0.50, 0.50, 0.12, 0.00, 0.41),
        (-0.15, 0.15, 0.55, 0.06, 0.56),
        (-0.20, 0.22, 0.75, 0.56, 0.84),
        (0.05, 0.20, 0.25, 0.84, 1.00),
    ),
    (
        (-0.50, 0.50, 0.70, 0.00, 0.48),
        (-0.50, 0.50, 1.00, 0.48, 0.82),
        (-0.45, 0.45, 0.32, 0.82, 1.00),
    ),
)


@dataclass(frozen=True, slots=True)
class Prism:
    """Ring (counter-clockwise) [m], shape (corner, 2), between two heights [m]."""

    ring: Float
    bottom: float
    top: float
    instance: int


def rotation(heading: float, pitch: float, roll: float) -> Float:
    """World <- sensor: Rz(heading) Ry(pitch) Rx(roll), shape (3, 3)."""
    c, s = np.cos([heading, pitch, roll]), np.sin([heading, pitch, roll])
    z = np.array([[c[0], -s[0], 0], [s[0], c[0], 0], [0, 0, 1]])
    y = np.array([[c[1], 0, s[1]], [0, 1, 0], [-s[1], 0, c[1]]])
    x = np.array([[1, 0, 0], [0, c[2], -s[2]], [0, s[2], c[2]]])
    turned: Float = z @ y @ x
    return turned


def body(vehicle: Vehicle) -> list[Prism]:
    """The boxes of a vehicle."""
    length, width, height = vehicle.size
    x, y, z = vehicle.position
    c, s = np.cos(vehicle.heading), np.sin(vehicle.heading)
    boxes = []
    for rear, front, share, bottom, top in PARTS[vehicle.body]:
        half = share * width / 2
        ring = np.array(
            [
                (rear * length, -half),
                (front * length, -half),
                (front * length, half),
                (rear * length, half),
            ]
        )
        world = ring @ np.array([[c, s], [-s, c]]) + (x, y)
        boxes.append(Prism(world, z + bottom * height, z + top * height, vehicle.id))
    return boxes


def prisms(scene: Scene, own: int) -> list[Prism]:
    """Everything but the ground and the body of vehicle `own`."""
    found = [box for v in scene.vehicles if v.id != own for box in body(v)]
    for k, building in enumerate(scene.buildings):
        ring = np.array(building.ring, float)
        x, y = ring.T
        if (x * np.roll(y, -1) - y * np.roll(x, -1)).sum() < 0:
            ring = ring[::-1]
        found.append(Prism(ring, 0.0, building.height, BUILDING - k))
    return found


def inside(ring: Float, points: Float) -> npt.NDArray[np.bool_]:
    """Whether points, shape (n, 2), lie in a ring (crossing number), shape (n,)."""
    x, y = points[:, :1], points[:, 1:]
    (x0, y0), (x1, y1) = ring.T, np.roll(ring, -1, axis=0).T
    straddles = (y0 > y) != (y1 > y)
    with np.errstate(divide="ignore", invalid="ignore"):
        crossing = x0 + (y - y0) * (x1 - x0) / (y1 - y0)
    odd: npt.NDArray[np.bool_] = (straddles & (x < crossing)).sum(axis=1) % 2 == 1
    return odd


def cast(
    scene: Scene, own: int, origin: Float, direction: Float, reach: float
) -> tuple[Float, npt.NDArray[np.int64]]:
    """Distance [m], `inf` for none, and instance of the first hit of each ray.

    Args:
        scene: what there is.
        own: the vehicle that carries the sensor.
        origin: of all rays, world frame [m], shape (3,).
        direction: unit vectors, world frame, shape (ray, 3).
        reach: the largest distance [m].
    """
    nearest = np.full(len(direction), np.inf)
    instance = np.full(len(direction), NOTHING)

    def offer(distance: Float, hit: npt.NDArray[np.bool_], name: int) -> None:
        nearer = hit & (distance > TOUCHING) & (distance <= reach) & (distance < nearest)
        nearest[nearer] = distance[nearer]
        instance[nearer] = name

    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        offer(-origin[2] / direction[:, 2], direction[:, 2] < 0, GROUND)
        for prism in prisms(scene, own):
            for z, side in ((prism.top, -1.0), (prism.bottom, 1.0)):
                t = (z - origin[2]) / direction[:, 2]
                candidate = (direction[:, 2] * side > 0) & (t > 0) & (t < reach)
                within = np.zeros(len(direction), np.bool_)
                points = origin[:2] + t[candidate, None] * direction[candidate, :2]
                within[candidate] = inside(prism.ring, points)
                offer(t, within, prism.instance)
            for a, b in zip(prism.ring, np.roll(prism.ring, -1, axis=0), strict=True):
                edge = b - a
                normal = np.array([edge[1], -edge[0]])  # outwards
                towards = direction[:, :2] @ normal
                t = ((a - origin[:2]) @ normal) / towards
                along = (origin[:2] + t[:, None] * direction[:, :2] - a) @ edge / (edge @ edge)
                height = origin[2] + t * direction[:, 2]
                hit = (towards < 0) & (along >= 0) & (along <= 1)
                hit &= (height >= prism.bottom) & (height <= prism.top)
                offer(t, hit, prism.instance)
    return nearest, instance
