"""A driving network: from scans, messages and the ego vehicle's state to pedals and wheel."""

from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np

from fmus.driving.network.architecture import EGO, Architecture
from fmus.driving.network.fixed_point import Dense, rectified, rounded
from fmus.driving.network.fusion import LENGTH_SCALE, Fusion, Observed
from fmus.physics.plane import Frame, turned
from orchestrator.signal import Array

LOOKAHEAD: Final = (4.0, 8.0, 16.0, 24.0, 32.0)
"""Distances along the route at which the network sees it [m]."""


class Head:
    """Makes the command of the fused keypoints and the ego vehicle's numbers."""

    def __init__(self, architecture: Architecture, weights: Mapping[str, Array]) -> None:
        del architecture
        self._first = Dense.of(weights["head.first.weight"], weights["head.first.bias"])
        self._second = Dense.of(weights["head.second.weight"], weights["head.second.bias"])

    def command(self, fused: Array, ego: Array) -> Array:
        """The command: accelerate 0..1, brake 0..1, steer -1..1, shape (3,).

        One pedal at a time: the one that is pressed less is released, the accelerator if both
        are equal.

        Args:
            fused: of `Fusion.fuse`, shape (pooled,).
            ego: of `ego_numbers`, shape (EGO,).
        """
        first = rectified(self._first(np.concatenate([fused, ego])))
        accelerate, brake, steer = self._second(first).tolist()
        accelerate, brake = min(max(accelerate, 0.0), 1.0), min(max(brake, 0.0), 1.0)
        if brake >= accelerate:
            accelerate = 0.0
        else:
            brake = 0.0
        return np.array([accelerate, brake, min(max(steer, -1.0), 1.0)])


class DrivingNetwork:
    """Fusion and head; encoders are where the sensors are."""

    def __init__(self, architecture: Architecture, weights: Mapping[str, Array]) -> None:
        self._fusion = Fusion(architecture, weights)
        self._head = Head(architecture, weights)

    def drive(
        self,
        observed: Sequence[Observed],
        *,
        frame: Frame,
        speed: float,
        wanted_speed: float,
        route: Array,
    ) -> Array:
        """The command: accelerate 0..1, brake 0..1, steer -1..1, shape (3,).

        Args:
            observed: keypoints of the ego vehicle's last scan, and of what it received.
            frame: of the ego vehicle.
            speed: of it [m/s].
            wanted_speed: where nothing is in the way [m/s].
            route: centre line from the vehicle on, world frame [m], shape (vertex, 2).
        """
        fused = self._fusion.fuse(observed, frame, speed)
        return self._head.command(fused, ego_numbers(frame, speed, wanted_speed, route))


def ego_numbers(frame: Frame, speed: float, wanted_speed: float, route: Array) -> Array:
    """Speed, wanted speed, and places of the route ahead and to the left; shape (EGO,).

    All are divided by `LENGTH_SCALE`; a route that ends before is continued straight on.

    Args:
        frame: of the ego vehicle.
        speed: of the ego vehicle [m/s].
        wanted_speed: where nothing is in the way [m/s].
        route: centre line from the vehicle on, world frame [m], shape (vertex, 2).
    """
    places = along(route, LOOKAHEAD)
    x, y = turned(places[:, 0] - frame.x, places[:, 1] - frame.y, -frame.heading)
    numbers = np.empty(EGO)
    numbers[:2] = speed, wanted_speed
    numbers[2::2], numbers[3::2] = x, y
    return rounded(numbers / LENGTH_SCALE)


def along(route: Array, distances: Sequence[float]) -> Array:
    """Places on `route` at `distances` [m] from its beginning; straight on beyond its end.

    Args:
        route: [m], shape (vertex, 2), at least two different vertices.
        distances: [m], ascending.

    Returns:
        Places [m], shape (distance, 2).
    """
    edge = route[1:] - route[:-1]
    length = np.sqrt(edge[:, 0] * edge[:, 0] + edge[:, 1] * edge[:, 1])
    edge, start, length = edge[length > 0], route[:-1][length > 0], length[length > 0]
    begin = np.concatenate([[0.0], np.cumsum(length)[:-1]])
    wanted = np.asarray(distances)
    part = np.maximum(np.searchsorted(begin, wanted, side="right") - 1, 0)
    share = (wanted - begin[part]) / length[part]
    return np.asarray(start[part] + share[:, None] * edge[part])
