"""When moving boxes touch."""

import numpy as np

from orchestrator.signal import Array


def time_to_contact(
    offset: Array, velocity: Array, headings: tuple[Array, Array], sizes: tuple[Array, Array]
) -> Array:
    """Time until two boxes touch that keep their velocities and headings.

    Convex bodies overlap at a time if no edge normal of either separates them then (separating axis
    theorem). Along each normal the projections overlap in one interval of time; the bodies touch
    from the latest beginning to the earliest end of these intervals.

    Args:
        offset: middle of the second box, seen from that of the first [m], shape (pair, 2).
        velocity: of the second box, seen from the first [m/s], shape (pair, 2).
        headings: of both boxes, counter-clockwise from east [rad], shape (pair,) each.
        sizes: their lengths and widths [m], shape (pair, 2) each.

    Returns:
        The time [s], 0 if they overlap and infinite if they never will, shape (pair,).
    """
    begin, end = np.full(len(offset), -np.inf), np.full(len(offset), np.inf)
    turned = headings[1] - headings[0]
    cosine, sine = np.abs(np.cos(turned)), np.abs(np.sin(turned))
    for own in (0, 1):
        length, width = sizes[1 - own].T
        along, across = cosine * length + sine * width, sine * length + cosine * width
        axis = np.stack([np.cos(headings[own]), np.sin(headings[own])], axis=1)
        normal = np.stack([-axis[:, 1], axis[:, 0]], axis=1)
        for direction, extent, other in (
            (axis, sizes[own][:, 0], along),
            (normal, sizes[own][:, 1], across),
        ):
            reach = (extent + other) / 2
            place, speed = (offset * direction).sum(axis=1), (velocity * direction).sum(axis=1)
            first, last = _overlap(place, speed, reach)
            begin, end = np.maximum(begin, first), np.minimum(end, last)
    meets = (begin < end) & (end > 0)
    return np.where(meets, np.maximum(begin, 0.0), np.inf)


def _overlap(place: Array, speed: Array, reach: Array) -> tuple[Array, Array]:
    """When |place + speed t| < reach: from when, until when; an empty interval if never."""
    moves = speed != 0.0
    divisor = np.where(moves, np.abs(speed), 1.0)
    middle = -place * np.sign(speed) / divisor
    half = reach / divisor
    stays = np.abs(place) < reach
    begin = np.where(moves, middle - half, np.where(stays, -np.inf, np.inf))
    end = np.where(moves, middle + half, np.where(stays, np.inf, -np.inf))
    return begin, end
