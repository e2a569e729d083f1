"""Prisms as triangles, for casters that know nothing else."""

from collections.abc import Iterable

import numpy as np
import numpy.typing as npt

from benchmarks.lidar.caster import Prism

Float = npt.NDArray[np.float64]
Int = npt.NDArray[np.int64]


def triangles(prism: Prism) -> Float:
    """The sides and the top of a prism [m], shape (triangle, 3, 3).

    Bottoms are left out: they stand on the ground, or are lower than every sensor.
    """
    low, high = (np.column_stack([prism.ring, np.full(len(prism.ring), z)])
                 for z in (prism.bottom, prism.top))  # fmt: skip
    after_low, after_high = np.roll(low, -1, axis=0), np.roll(high, -1, axis=0)
    sides = [
        np.stack([low, after_low, after_high], axis=1),
        np.stack([low, after_high, high], axis=1),
    ]
    return np.concatenate([*sides, high[ears(prism.ring)]])


def mesh(prisms: Iterable[Prism]) -> tuple[Float, Int]:
    """Triangles of many prisms [m], shape (triangle, 3, 3), and their instances, (triangle,)."""
    parts = [(triangles(prism), prism.instance) for prism in prisms]
    found = np.concatenate([part for part, _ in parts])
    return found, np.repeat([name for _, name in parts], [len(part) for part, _ in parts])


def ears(ring: Float) -> Int:
    """A simple polygon as triangles, by cutting off ears (Meisters 1975).

    Args:
        ring: corners, counter-clockwise, shape (corner, 2).

    Returns:
        Numbers of the corners, shape (corner - 2, 3).
    """
    left = list(range(len(ring)))
    found = []
    while len(left) > 3:
        k = next(k for k in range(len(left)) if _is_ear(ring, left, k))
        found.append((left[k - 1], left[k], left[(k + 1) % len(left)]))
        del left[k]
    return np.array([*found, tuple(left)], np.int64)


def _is_ear(ring: Float, left: list[int], k: int) -> bool:
    corner = (left[k - 1], left[k], left[(k + 1) % len(left)])
    a, b, c = ring[list(corner)]
    if _area(a, b, c) <= 0:
        return False
    others = (ring[i] for i in left if i not in corner)
    return not any(min(_area(a, b, p), _area(b, c, p), _area(c, a, p)) >= 0 for p in others)


def _area(a: Float, b: Float, c: Float) -> float:
    """Twice the area of a triangle, counter-clockwise positive."""
    return float((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))
