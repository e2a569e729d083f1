"""Polygons cut into triangles, for viewers that draw nothing else."""

import numpy as np

from orchestrator.signal import Array


def triangulated(ring: Array) -> Array:
    """Triangles that cover a simple polygon, by cutting off ears.

    Args:
        ring: corners [m], an open ring in either sense, shape (corner, 2).

    Returns:
        Indices of corners, counter-clockwise, int64, shape (triangle, 3); corner - 2 triangles of a
        simple polygon, fewer where corners are on a line or the outline crosses itself.
    """
    x, y = ring[:, 0].tolist(), ring[:, 1].tolist()
    left = list(range(len(ring)))
    if sum(x[k - 1] * y[k] - x[k] * y[k - 1] for k in left) < 0.0:
        left.reverse()

    def turn(a: int, b: int, c: int) -> float:
        return float((x[b] - x[a]) * (y[c] - y[a]) - (x[c] - x[a]) * (y[b] - y[a]))

    def is_ear(a: int, b: int, c: int) -> bool:
        return turn(a, b, c) > 0.0 and not any(
            turn(a, b, k) >= 0.0 and turn(b, c, k) >= 0.0 and turn(c, a, k) >= 0.0
            for k in left
            if k not in (a, b, c)
        )

    found = []
    while len(left) > 2:
        corners = [(left[k - 1], left[k], left[(k + 1) % len(left)]) for k in range(len(left))]
        flat = [b for a, b, c in corners if turn(a, b, c) == 0.0]
        if flat:
            left.remove(flat[0])
            continue
        ear = next((each for each in corners if is_ear(*each)), None)
        if ear is None:
            break
        found.append(ear)
        left.remove(ear[1])
    return np.array(found, np.int64).reshape(-1, 3)


def prism(ring: Array, height: float) -> tuple[Array, Array]:
    """The walls and the roof of a building.

    Args:
        ring: corners [m], an open ring, shape (corner, 2).
        height: above the ground [m].

    Returns:
        Vertices [m], shape (2 corner, 3); the triangles as indices of them, shape (triangle, 3).
    """
    count = len(ring)
    ground = np.column_stack([ring, np.zeros(count)])
    roof = np.column_stack([ring, np.full(count, height)])
    here = np.arange(count)
    following = (here + 1) % count
    walls = np.concatenate(
        [
            np.column_stack([here, following, here + count]),
            np.column_stack([following, following + count, here + count]),
        ]
    )
    return np.concatenate([ground, roof]), np.concatenate([walls, triangulated(ring) + count])
