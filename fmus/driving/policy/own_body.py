"""Which of the objects that others saw are the ego vehicle itself."""

from dataclasses import dataclass
from typing import Final

import numpy as np

from fmus.driving.policy.ego import Ego
from fmus.messages.records import NO_VEHICLE
from fmus.physics.boxes import Boxes, corners, in_boxes
from orchestrator.signal import Array
from orchestrator.timebase import Duration, Time

ACCURACY: Final = 0.2
"""Accuracy of a lidar [m]: what overlaps a body by less may only touch it."""
MARGIN: Final = 0.5
"""Distance beyond the footprint that a view of it may reach [m]: errors of the sharer's pose and of
its box. What is of somebody else is hardly ever as near and as small."""
_MEMORY: Final[Duration] = 2_000_000_000
"""Time for which poses are remembered [ns]; facilities forget objects before that."""


@dataclass(frozen=True, slots=True)
class _Pose:
    """The ego vehicle at one time: metres, radians, and metres per second."""

    time: Time
    x: float
    y: float
    heading: float
    speed: float


class OwnBody:
    """Knows where the ego vehicle was lately, and so what others saw of it.

    An object is compared with the footprint at the time of its scan: so neither the ego's motion
    since, nor a wrong velocity of a body that is seen in part, matters. It is the ego if

    * it overlaps the footprint, less `ACCURACY`: two bodies are never in one place; or
    * it overlaps the footprint grown by `MARGIN`, and lies within the box, along its own sides,
      around that: it is no larger than a view of the ego, or of a part of it, can be.
    """

    def __init__(self) -> None:
        self._vehicle = NO_VEHICLE
        self._size = (0.0, 0.0)
        self._poses: list[_Pose] = []

    def update(self, ego: Ego, now: Time) -> None:
        """Take in where the ego is at `now` [ns]; while it is not there nothing is of it."""
        if ego.vehicle != self._vehicle:
            self._poses = []
        self._vehicle, self._size = ego.vehicle, (ego.length, ego.width)
        if ego.vehicle == NO_VEHICLE or not ego.length:
            return
        x, y = ego.position.tolist()
        self._poses = [pose for pose in self._poses if now - _MEMORY <= pose.time < now]
        self._poses.append(_Pose(now, x, y, ego.heading, ego.speed))

    def is_in(self, objects: Array) -> Array:
        """Which objects are the ego.

        Args:
            objects: as others saw them, `OBJECT` records, shape (object,).

        Returns:
            A mask, bool, shape (object,).
        """
        if not self._poses or not len(objects):
            return np.zeros(len(objects), np.bool_)
        center, heading = self._at(objects["time"])
        size = np.array(self._size)
        boxes = Boxes(objects["position"], objects["angle"], objects["size"])
        near = boxes.overlap(Boxes(center, heading, size + 2 * MARGIN))
        if not near.any():
            return near
        grown = corners(center, heading, size + 2 * MARGIN)  # (object, 4, 2)
        local = in_boxes(grown, boxes.center[:, None], boxes.heading[:, None])
        half = boxes.size / 2
        within = (local.min(axis=1) <= -half) & (local.max(axis=1) >= half)
        same = boxes.overlap(Boxes(center, heading, np.maximum(size - 2 * ACCURACY, 0.0)))
        return np.asarray(same | (near & within.all(axis=1)))

    def _at(self, times: Array) -> tuple[Array, Array]:
        """Centres [m], shape (time, 2), and headings [rad], shape (time,), at times [ns].

        Between two poses on a straight line; before the first one with its velocity.
        """
        since = times[0]  # differences of times are small numbers, and exact
        known = np.array([pose.time - since for pose in self._poses], np.float64)
        asked = (times - since).astype(np.float64)

        def interpolated(values: list[float]) -> Array:
            return np.asarray(np.interp(asked, known, values))

        heading = interpolated(np.unwrap([pose.heading for pose in self._poses]).tolist())
        beyond = (asked - np.clip(asked, known[0], known[-1])) / 1e9
        ahead = beyond * interpolated([pose.speed for pose in self._poses])
        x = interpolated([pose.x for pose in self._poses]) + ahead * np.cos(heading)
        y = interpolated([pose.y for pose in self._poses]) + ahead * np.sin(heading)
        return np.stack([x, y], axis=-1), heading
