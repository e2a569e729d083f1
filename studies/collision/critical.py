"""Critical points: the packet error rates at which the collision rate crosses a level."""

from collections.abc import Sequence
from typing import Any, Final

from studies.collision.curve import Curve, Resampling, interval
from studies.collision.curves import curves
from studies.collision.runs import Point
from studies.method.estimates import columns

LEVELS: Final = (0.01, 0.1, 0.5)
"""Collision rates."""


def rows(points: Sequence[Point]) -> list[dict[str, Any]]:
    """One row per curve and level.

    `per` is where the curve, made to rise and straight between its points, crosses `level`;
    `per_low` to `per_high` is the interval of 95 % (bootstrap over seeds). -inf: it is there from
    its first point on, which `first` is; inf: it never is, up to its last point, `last`.
    """
    return [row for name, each in curves(points).items() for row in _rows(name.columns(), each)]


def _rows(name: dict[str, Any], points: Sequence[Point]) -> list[dict[str, Any]]:
    resampling = Resampling.of(points)
    curve = Curve.of(points, resampling)
    return [
        {
            **name,
            "points": len(points),
            "seeds": len(resampling.seeds),
            "first": float(curve.per[0, 0]),
            "last": float(curve.per[0, -1]),
            "level": level,
            **columns("per", interval(curve.crossing(level))),
        }
        for level in LEVELS
    ]
