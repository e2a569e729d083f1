"""The faces that the sensors of a batch may see, each in the frame of its sensor."""

from dataclasses import dataclass
from typing import Self, TypeAlias

import numpy as np
import torch
from torch import Tensor

from fmus.lidar.gpu.pattern import Pattern
from fmus.lidar.gpu.ragged import expand, pick
from fmus.lidar.gpu.scene import GROUND_REFLECTIVITY, Float, Int, Prisms
from fmus.messages.records import GROUND

Vectors: TypeAlias = tuple[Tensor, Tensor, Tensor]
"""The components x, y and z of vectors, of equal shapes."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PrismTensors:
    """`Prisms` on the device, and the ground as if it were one more.

    Attributes:
        corner, first, count, bottom, top, owner: as in `Prisms`.
        circle: `Prisms.circles()`.
        instance, reflectivity: as in `Prisms`; the ground follows, shape (prism + 1,).
    """

    corner: Tensor
    first: Tensor
    count: Tensor
    bottom: Tensor
    top: Tensor
    owner: Tensor
    circle: Tensor
    instance: Tensor
    reflectivity: Tensor

    @classmethod
    def of(cls, prisms: Prisms, device: torch.device) -> Self:
        """Copy to the device."""

        def there(array: Float | Int) -> Tensor:
            return torch.from_numpy(array).to(device)

        return cls(
            corner=there(prisms.corner),
            first=there(prisms.first),
            count=there(prisms.count),
            bottom=there(prisms.bottom),
            top=there(prisms.top),
            owner=there(prisms.owner),
            circle=there(prisms.circles()),
            instance=there(np.append(prisms.instance, GROUND)),
            reflectivity=there(np.append(prisms.reflectivity, GROUND_REFLECTIVITY)),
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Viewpoints:
    """The sensors of a batch.

    Attributes:
        position: world frame [m], shape (sensor, 3).
        cosine, sine: of the heading, shape (sensor,).
        vehicle: index of the vehicle that carries it, shape (sensor,).
        key: of its random numbers, int64, shape (sensor,).
    """

    position: Tensor
    cosine: Tensor
    sine: Tensor
    vehicle: Tensor
    key: Tensor


@dataclass(frozen=True, slots=True, kw_only=True)
class View:
    """Faces and their edges, in the frames of their sensors.

    The order of the faces decides between hits at equal distance: walls, then caps (roofs and
    undersides), each in the order of the prisms. The ground, seen by all, follows as one more.

    Attributes:
        normal: outward unit vectors, of shape (face + 1,).
        offset: normal . p of the points p of the face [m], negative, shape (face,).
        sensor: whose frame it is, int64, shape (face,).
        prism: which it belongs to; of the ground, one after the last, int64, shape (face + 1,).
        start, end: of the edges [m], of shape (edge,).
        face: whose edge it is, int64, shape (edge,).
    """

    normal: Vectors
    offset: Tensor
    sensor: Tensor
    prism: Tensor
    start: Vectors
    end: Vectors
    face: Tensor

    @property
    def ground(self) -> int:
        """The number of the face that is the ground."""
        return len(self.offset)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Pairs:
    """A sensor and a prism near it, shape (pair,) each.

    Attributes:
        sensor, prism: which.
        bottom, top: of the prism over the sensor [m].
        cap: height of the face that the sensor sees from above or below [m]; 0 if it sees none.
    """

    sensor: Tensor
    prism: Tensor
    bottom: Tensor
    top: Tensor
    cap: Tensor


@dataclass(frozen=True, slots=True, kw_only=True)
class _Sides:
    """The sides of these prisms: edges a - b of their rings in the heading frame.

    Attributes:
        pair: which it belongs to, shape (side,).
        ax, ay, bx, by: counter-clockwise [m], shape (side,) each.
    """

    pair: Tensor
    ax: Tensor
    ay: Tensor
    bx: Tensor
    by: Tensor


@dataclass(frozen=True, slots=True, kw_only=True)
class _Edges:
    """Edges of faces in the heading frame."""

    start: Vectors
    end: Vectors
    face: Tensor


def view(prisms: PrismTensors, sensors: Viewpoints, pattern: Pattern) -> View:
    """The faces within range and turned towards their sensors.

    Args:
        prisms: everything there is.
        sensors: that look.
        pattern: gives the range and the tilt.
    """
    pairs = _pairs(prisms, sensors, pattern.reach)
    sides = _sides(prisms, sensors, pairs)
    area = sides.ax * (sides.by - sides.ay) - sides.ay * (sides.bx - sides.ax)
    seen = (area < 0.0) & (_distance_square(sides) <= pattern.reach**2)
    wall, cap = torch.nonzero(seen)[:, 0], torch.nonzero(pairs.cap)[:, 0]
    around, rim = _wall_edges(pairs, sides, wall), _cap_edges(pairs, sides, len(wall))
    dx, dy = (sides.bx - sides.ax)[wall], (sides.by - sides.ay)[wall]
    length, height = torch.sqrt(dx * dx + dy * dy), pairs.cap[cap]
    pair = torch.cat([sides.pair[wall], cap])
    level, ground = height.new_zeros(len(height) + 1), pair.new_tensor([len(prisms.count)])
    return View(
        normal=pattern.into_sensor_frame(
            torch.cat([dy / length, level]),
            torch.cat([-dx / length, level]),
            torch.cat([torch.zeros_like(length), -torch.sign(height), height.new_ones(1)]),
        ),
        offset=torch.cat([area[wall] / length, -height.abs()]),
        sensor=pairs.sensor[pair],
        prism=torch.cat([pairs.prism[pair], ground]),
        start=pattern.into_sensor_frame(*_joined(around.start, rim.start)),
        end=pattern.into_sensor_frame(*_joined(around.end, rim.end)),
        face=torch.cat([around.face, rim.face]),
    )


def _pairs(prisms: PrismTensors, sensors: Viewpoints, reach: float) -> _Pairs:
    """Prisms within range of a sensor that are not part of the vehicle which carries it."""
    offset = prisms.circle[:, :2] - sensors.position[:, None, :2]  # (sensor, prism, 2)
    x, y = offset[..., 0], offset[..., 1]
    limit = reach + prisms.circle[:, 2]
    near = (x * x + y * y <= limit * limit) & (prisms.owner != sensors.vehicle[:, None])
    sensor, prism = torch.nonzero(near, as_tuple=True)
    height = sensors.position[sensor, 2]
    bottom, top = prisms.bottom[prism] - height, prisms.top[prism] - height
    cap = torch.where(top < 0.0, top, torch.clamp(bottom, min=0.0))
    return _Pairs(sensor=sensor, prism=prism, bottom=bottom, top=top, cap=cap)


def _sides(prisms: PrismTensors, sensors: Viewpoints, pairs: _Pairs) -> _Sides:
    pair, number = expand(prisms.count[pairs.prism])
    prism, sensor = pick(pairs.prism, pair), pick(pairs.sensor, pair)
    first, last = pick(prisms.first, prism), pick(prisms.count, prism) - 1
    following = torch.where(number < last, number + 1, 0)
    cosine, sine = pick(sensors.cosine, sensor), pick(sensors.sine, sensor)
    origin = sensors.position.index_select(0, sensor)

    def turned(corner: Tensor) -> tuple[Tensor, Tensor]:
        offset = prisms.corner.index_select(0, corner) - origin[:, :2]
        x, y = offset[:, 0], offset[:, 1]
        return cosine * x + sine * y, cosine * y - sine * x

    ax, ay = turned(first + number)
    bx, by = turned(first + following)
    return _Sides(pair=pair, ax=ax, ay=ay, bx=bx, by=by)


def _distance_square(sides: _Sides) -> Tensor:
    """Squares of the distances of the sides from their sensors, shape (side,)."""
    x, y = sides.bx - sides.ax, sides.by - sides.ay
    square = x * x + y * y
    along = -(sides.ax * x + sides.ay * y) / torch.where(square > 0.0, square, 1.0)
    along = torch.clamp(along, 0.0, 1.0)
    px, py = sides.ax + along * x, sides.ay + along * y
    return px * px + py * py


def _wall_edges(pairs: _Pairs, sides: _Sides, wall: Tensor) -> _Edges:
    """Bottom, end, top and beginning of each wall."""
    ax, ay, bx, by = sides.ax[wall], sides.ay[wall], sides.bx[wall], sides.by[wall]
    bottom, top = pairs.bottom[sides.pair[wall]], pairs.top[sides.pair[wall]]
    return _Edges(
        start=(
            torch.cat([ax, bx, bx, ax]),
            torch.cat([ay, by, by, ay]),
            torch.cat([bottom, bottom, top, top]),
        ),
        end=(
            torch.cat([bx, bx, ax, ax]),
            torch.cat([by, by, ay, ay]),
            torch.cat([bottom, top, top, bottom]),
        ),
        face=torch.arange(len(wall), device=wall.device).repeat(4),
    )


def _cap_edges(pairs: _Pairs, sides: _Sides, walls: int) -> _Edges:
    """The edges around each cap; caps are numbered after the walls."""
    number = walls - 1 + torch.cumsum(pairs.cap != 0.0, 0)
    rim = torch.nonzero(pairs.cap[sides.pair])[:, 0]
    pair = sides.pair[rim]
    height = pairs.cap[pair]
    return _Edges(
        start=(sides.ax[rim], sides.ay[rim], height),
        end=(sides.bx[rim], sides.by[rim], height),
        face=number[pair],
    )


def _joined(a: Vectors, b: Vectors) -> Vectors:
    return torch.cat([a[0], b[0]]), torch.cat([a[1], b[1]]), torch.cat([a[2], b[2]])
