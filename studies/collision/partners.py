"""With whom the ego collides."""

from collections import Counter
from collections.abc import Sequence
from typing import Any

from studies.collision.runs import Point


def rows(points: Sequence[Point]) -> list[dict[str, Any]]:
    """Collisions by policy, compression and partner, under all conditions of an experiment."""
    found: dict[tuple[str, str, int | None], Counter[str]] = {}
    for point in points:
        key = (point.experiment, point.condition.policy, point.condition.compression)
        counter = found.setdefault(key, Counter())
        counter.update(run.partner or "unknown" for run in point.runs.values() if run.collision)
    return [
        {
            "experiment": experiment,
            "policy": policy,
            "compression": compression,
            "partner": partner,
            "collisions": counter[partner],
        }
        for (experiment, policy, compression), counter in found.items()
        for partner in sorted(counter)
    ]
