"""When and where the ego would meet another body, if both go on as they do."""

from dataclasses import dataclass

import numpy as np

from fmus.driving.policy.ego import Ego
from fmus.driving.policy.route import Box, Segments
from fmus.messages.columns import rows_of
from orchestrator.signal import Array


@dataclass(frozen=True, slots=True, kw_only=True)
class Bodies:
    """Detected objects: boxes that keep their velocities.

    Attributes:
        corners: of the boxes at the start of the prediction, in a walk around each [m],
            (body, 4, 2).
        velocity: [m/s], (body, 2).
    """

    corners: Array
    velocity: Array

    def only(self, rows: Array) -> "Bodies":
        """The bodies in `rows`: their indices, shape (row,), or a mask, shape (body,)."""
        return rows_of(self, rows)


@dataclass(frozen=True, slots=True, kw_only=True)
class Conflicts:
    """The first meeting with each body.

    Attributes:
        time: from now [s], infinite without a conflict, (body,).
        distance: to it, ahead of the ego's front [m], (body,).
    """

    time: Array
    distance: Array

    @classmethod
    def none(cls, bodies: int) -> "Conflicts":
        """No meeting with any of so many bodies."""
        return cls(time=np.full(bodies, np.inf), distance=np.zeros(bodies))


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
        motions = (
            ego.speed * times,
            taking_up_speed(ego, self.cruise, self.acceleration, times),
        )
        reach = ego.length / 2 + self.longitudinal_margin
        side = ego.width / 2 + self.lateral_margin
        behind, beyond = np.min(motions) - reach, np.max(motions) + reach
        line = Segments.of(ego.route)
        size = _largest(bodies)  # a body reaches along the route beyond its point beside it
        near = _near(line.box(behind - size, beyond + size, side), bodies, times)
        (rows,) = np.nonzero(near.any(axis=1))
        rear, front, clearance = _extents(line, bodies.only(rows), times, near[rows])
        ahead = front[:, :1] >= -ego.length / 2
        beside = ahead & (clearance <= side)
        time = np.full(len(rows), np.inf)
        distance = np.zeros(len(rows))
        for travelled in motions:
            met = beside & (rear <= travelled + reach) & (front >= travelled - reach)
            first = np.where(met.any(axis=1), times[np.argmax(met, axis=1)], np.inf)
            nearest = np.where(met, rear, np.inf).min(axis=1) - ego.length / 2
            distance = np.where(first < time, np.maximum(nearest, 0.0), distance)
            time = np.minimum(time, first)
        conflicts = Conflicts.none(len(near))
        conflicts.time[rows], conflicts.distance[rows] = time, distance
        return conflicts


def taking_up_speed(ego: Ego, cruise: float, acceleration: float, times: Array) -> Array:
    """How far the ego comes if it takes up the speed `cruise`, or keeps one that is higher.

    Args:
        ego: as it is now.
        cruise: the speed that it takes up [m/s].
        acceleration: with which it does [m/s^2].
        times: from now [s], any shape.

    Returns:
        Distance from where it is now [m], of the shape of `times`.
    """
    until = max(cruise - ego.speed, 0.0) / acceleration
    ramp = np.minimum(times, until)
    rest = np.maximum(times - until, 0.0)
    travelled: Array = (
        ego.speed * ramp + 0.5 * acceleration * ramp**2 + np.maximum(ego.speed, cruise) * rest
    )
    return travelled


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
    return Segments.of(route).project(points)


def _near(place: Box, bodies: Bodies, times: Array) -> Array:
    """Whether each body touches a box at each time, bool (body, time)."""
    moved = times[:, None] * bodies.velocity[:, None]  # (body, time, 2)
    reached = bodies.corners.min(axis=1)[:, None] + moved <= place.upper
    reached &= bodies.corners.max(axis=1)[:, None] + moved >= place.lower
    return np.asarray(reached.all(axis=-1))


def _largest(bodies: Bodies) -> float:
    """The longest diagonal [m]."""
    diagonal = bodies.corners[:, 2] - bodies.corners[:, 0]
    return float(np.hypot(*diagonal.T).max(initial=0.0))


def _extents(route: Segments, bodies: Bodies, times: Array, near: Array) -> Array:
    """Where each body begins and ends along `route`, and its distance to the centre line.

    They are projected at the times when they are near and at the first; at the others they have
    no extent. Bodies that stand are projected once.

    Returns:
        Rear, front, clearance [m], shape (3, body, time).
    """
    standing = ~np.any(bodies.velocity, axis=1)
    wanted = near & ~standing[:, None]
    wanted[:, 0] = True
    extents = np.empty((3, *near.shape))
    extents[0], extents[1], extents[2] = np.inf, -np.inf, np.inf
    rows, columns = np.nonzero(wanted)
    along, across = route.project(_corners(bodies, rows, times[columns]))
    extents[0, rows, columns] = along.min(axis=-1)
    extents[1, rows, columns] = along.max(axis=-1)
    beside = np.maximum(across.min(axis=-1), -across.max(axis=-1))
    extents[2, rows, columns] = np.maximum(beside, 0.0)
    extents[:, standing] = extents[:, standing, :1]
    return extents


def _corners(bodies: Bodies, rows: Array, times: Array) -> Array:
    """The corners of the bodies in `rows`, each at its own time, shape (row, 4, 2)."""
    chosen = bodies.only(rows)
    moved = times[:, None] * chosen.velocity
    return np.asarray(chosen.corners + moved[:, None])
