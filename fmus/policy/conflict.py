"""When and where the ego would meet another body, if both go on as they do."""

from dataclasses import dataclass

import numpy as np

from orchestrator.signal import Array


@dataclass(frozen=True, slots=True, kw_only=True)
class Ego:
    """The ego vehicle.

    Attributes:
        speed: along the route [m/s].
        length, width: of the body [m].
        route: centre line from the ego's centre on [m], shape (vertex, 2), at least 2.
    """

    speed: float
    length: float
    width: float
    route: Array


@dataclass(frozen=True, slots=True, kw_only=True)
class Bodies:
    """Detected objects: boxes along the world's axes that keep their velocities.

    Attributes:
        minimum: lower corners at the start of the prediction [m], (body, 2).
        maximum: upper corners [m], (body, 2).
        velocity: [m/s], (body, 2).
    """

    minimum: Array
    maximum: Array
    velocity: Array


@dataclass(frozen=True, slots=True, kw_only=True)
class Conflicts:
    """The first meeting with each body.

    Attributes:
        time: from now [s], infinite without a conflict, (body,).
        distance: to it, ahead of the ego's front [m], (body,).
    """

    time: Array
    distance: Array


@dataclass(frozen=True, slots=True, kw_only=True)
class Prediction:
    """How far and how carefully to look ahead.

    Attributes:
        horizon: of the prediction [s].
        step: of the prediction [s].
        lateral_margin: added on both sides of the ego's body [m].
        longitudinal_margin: added before and behind it [m].
        acceleration: with which the ego would take up speed again [m/s^2].
        cruise: the speed it would take up [m/s].
    """

    horizon: float
    step: float
    lateral_margin: float
    longitudinal_margin: float
    acceleration: float
    cruise: float

    def first_conflicts(self, ego: Ego, bodies: Bodies) -> Conflicts:
        """The first time at which the ego's body, grown by the margins, meets each body.

        Two motions of the ego are considered, because it may choose either: keeping its
        speed and taking up its cruising speed. Its body covers its length and width along
        the centre line of the route. Bodies that are now behind the ego are left out: who
        follows is the one to keep the distance.
        """
        times = np.arange(0.0, self.horizon + self.step / 2, self.step)
        rear, front, clearance = _extents(ego.route, bodies, times)
        ahead = front[:, :1] >= -ego.length / 2
        beside = ahead & (clearance <= ego.width / 2 + self.lateral_margin)
        reach = ego.length / 2 + self.longitudinal_margin
        time = np.full(len(bodies.minimum), np.inf)
        distance = np.zeros(len(bodies.minimum))
        for travelled in (ego.speed * times, self._taking_up_speed(ego.speed, times)):
            met = beside & (rear <= travelled + reach) & (front >= travelled - reach)
            first = np.where(met.any(axis=1), times[np.argmax(met, axis=1)], np.inf)
            nearest = np.where(met, rear, np.inf).min(axis=1) - ego.length / 2
            distance = np.where(first < time, np.maximum(nearest, 0.0), distance)
            time = np.minimum(time, first)
        return Conflicts(time=time, distance=distance)

    def _taking_up_speed(self, speed: float, times: Array) -> Array:
        until = max(self.cruise - speed, 0.0) / self.acceleration
        ramp = np.minimum(times, until)
        cruise = np.maximum(speed, self.cruise)
        rest = np.maximum(times - until, 0.0)
        travelled: Array = speed * ramp + 0.5 * self.acceleration * ramp**2 + cruise * rest
        return travelled


def overlapping(ego: Ego, bodies: Bodies) -> Array:
    """Whether each body lies where the ego vehicle is, bool (body,).

    Two vehicles are never in one place: such a body is the ego itself, as others see it. Bodies
    that only touch it, within the accuracy of a lidar, do not overlap.
    """
    accuracy = 0.2  # m
    everything = np.ones(len(bodies.minimum), bool)
    along, across = project(ego.route, _corners(bodies, everything, np.zeros(1))[:, 0])
    length, width = ego.length / 2 - accuracy, ego.width / 2 - accuracy
    beside = (along.min(axis=1) > length) | (along.max(axis=1) < -length)
    beside |= (across.min(axis=1) > width) | (across.max(axis=1) < -width)
    return np.asarray(~beside)


def project(route: Array, points: Array) -> tuple[Array, Array]:
    """Distance along `route` and signed distance across it (left positive).

    The first and last segments are continued, so that points behind have negative and
    points beyond have larger distances than the route's length.

    Args:
        route: [m], shape (vertex, 2), at least two different vertices.
        points: [m], shape (..., 2).

    Returns:
        Along and across [m], each of the shape of `points` without its last axis.
    """
    start, edge = route[:-1], np.diff(route, axis=0)
    length = np.linalg.norm(edge, axis=1)
    start, edge, length = start[length > 0], edge[length > 0], length[length > 0]
    begin = np.concatenate([[0.0], np.cumsum(length)[:-1]])
    direction = edge / length[:, None]
    offset = points[..., None, :] - start
    along = (offset * direction).sum(axis=-1)
    lower = np.where(np.arange(len(length)) == 0, -np.inf, 0.0)
    upper = np.where(np.arange(len(length)) == len(length) - 1, np.inf, length)
    clipped = np.clip(along, lower, upper)
    foot = start + clipped[..., None] * direction
    distance = np.linalg.norm(points[..., None, :] - foot, axis=-1)
    nearest = np.argmin(distance, axis=-1)[..., None]
    side = direction[:, 0] * offset[..., 1] - direction[:, 1] * offset[..., 0]
    signed = np.copysign(distance, side)
    return (
        np.take_along_axis(begin + clipped, nearest, axis=-1)[..., 0],
        np.take_along_axis(signed, nearest, axis=-1)[..., 0],
    )


def _extents(route: Array, bodies: Bodies, times: Array) -> Array:
    """Where each body begins and ends along `route`, and its distance to the centre line.

    Bodies that stand are projected once.

    Returns:
        Rear, front, clearance [m], shape (3, body, time).
    """
    extents = np.empty((3, len(bodies.minimum), len(times)))
    moving: Array = np.any(bodies.velocity, axis=1)
    for rows, at in ((moving, times), (~moving, times[:1])):
        along, across = project(route, _corners(bodies, rows, at))
        extents[0, rows] = along.min(axis=-1)
        extents[1, rows] = along.max(axis=-1)
        beside = np.maximum(across.min(axis=-1), -across.max(axis=-1))
        extents[2, rows] = np.maximum(beside, 0.0)
    return extents


def _corners(bodies: Bodies, rows: Array, times: Array) -> Array:
    """The corners of the bodies in `rows` at each time, shape (body, time, 4, 2)."""
    choice = np.array([[0, 0], [1, 0], [1, 1], [0, 1]])
    box = np.stack([bodies.minimum[rows], bodies.maximum[rows]], axis=1)  # (body, 2, 2)
    corners = box[:, choice, np.arange(2)]  # (body, 4, 2)
    moved = times[:, None, None] * bodies.velocity[rows, None, None, :]
    return np.asarray(corners[:, None] + moved)
