"""Bodies within others: SUMO keeps no room for whom it does not put on a lane itself."""

from collections.abc import Collection, Iterator
from typing import Final

import numpy as np

from adapters.sumo.population import Poses, Roster
from adapters.traffic.geometry import Boxes, box_distance

_TOUCH: Final = 0.01
"""Bodies that are within each other by less than that [m] stand side by side."""


def overlaps(keys: Collection[str], roster: Roster, poses: Poses) -> Iterator[tuple[str, str]]:
    """Whose bodies overlap, as pairs of keys, each pair once, the one of `keys` first.

    Args:
        keys: of those who are asked about; who is not present overlaps with nobody.
        roster: who is there.
        poses: theirs.
    """
    size = np.maximum(roster.size[:, :2] - _TOUCH, 0.0)
    boxes = Boxes(center=poses.center, heading=poses.heading, size=size)
    told: set[int] = set()
    for key in keys:
        row = roster.row(key)
        if row is None:
            continue
        told.add(row)
        own = Boxes(center=poses.center[row], heading=poses.heading[row], size=size[row])
        for other in np.flatnonzero(box_distance(own, boxes) == 0.0).tolist():
            if other not in told:
                yield key, roster.vehicles[other].key
