"""Fusion: what the keypoints of all sensors, however many arrived, mean for the ego vehicle.

Each keypoint is brought into the ego vehicle's frame, with its age, and judged by itself; the
maximum over all keypoints of each number is what the head sees. So order and number do not
matter, and a keypoint that was lost is one voice less.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from fmus.driving.network.architecture import GEOMETRY, Architecture
from fmus.driving.network.fixed_point import Dense, rectified, rounded
from fmus.physics.plane import Frame, turned
from orchestrator.signal import Array

LENGTH_SCALE: Final = 8.0
"""Lengths [m] and speeds [m/s] are divided by this number."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Observed:
    """The keypoints of one scan, as far as they are known to the ego vehicle.

    Attributes:
        frame: of the sensor at the time of the scan.
        x, y: in that frame [m], shape (keypoint,).
        z: over the ground [m], shape (keypoint,).
        features: shape (keypoint, features).
        age: of the scan [s].
        own: whether it is of the ego vehicle's sensor.
    """

    frame: Frame
    x: Array
    y: Array
    z: Array
    features: Array
    age: float
    own: bool


class Fusion:
    """See the module."""

    def __init__(self, architecture: Architecture, weights: Mapping[str, Array]) -> None:
        self._architecture = architecture
        self._first = Dense.of(weights["fusion.first.weight"], weights["fusion.first.bias"])
        self._second = Dense.of(weights["fusion.second.weight"], weights["fusion.second.bias"])

    def fuse(self, observed: Sequence[Observed], ego: Frame, speed: float) -> Array:
        """What all keypoints mean together, shape (pooled,); zeros if there are none.

        Args:
            observed: by sensor and scan, in any order.
            ego: frame of the ego vehicle now.
            speed: of the ego vehicle [m/s].
        """
        rows = [self._rows(each, ego, speed) for each in observed if len(each.x)]
        if not rows:
            return np.zeros(self._architecture.pooled)
        first = rectified(self._first(np.concatenate(rows)))
        return np.asarray(rectified(self._second(first)).max(axis=0))

    def _rows(self, each: Observed, ego: Frame, speed: float) -> Array:
        """Inputs of the first layer, shape (keypoint, features + GEOMETRY)."""
        rows = np.empty((len(each.x), self._architecture.features + GEOMETRY))
        rows[:, :-GEOMETRY] = each.features
        vectors = rows[:, self._architecture.features - 2 * self._architecture.vectors : -GEOMETRY]
        ahead, left = turned(vectors[:, 0::2], vectors[:, 1::2], each.frame.turn(ego))
        vectors[:, 0::2], vectors[:, 1::2] = rounded(ahead), rounded(left)
        rows[:, -GEOMETRY:] = geometry(each, ego, speed)
        return rows


def geometry(each: Observed, ego: Frame, speed: float) -> Array:
    """What the fusion knows of keypoints beside their features.

    Args:
        each: the keypoints.
        ego: frame of the ego vehicle now.
        speed: of the ego vehicle [m/s].

    Returns:
        Shape (keypoint, GEOMETRY): place ahead, left, up [m] and speed of the ego [m/s], these
        divided by `LENGTH_SCALE`; age of the scan [s]; 1 if it is of the ego's own sensor; 1 if it
        is of another's.
    """
    x, y = each.frame.to(ego, each.x, each.y)
    numbers = np.empty((len(x), GEOMETRY))
    numbers[:, 0], numbers[:, 1], numbers[:, 2] = x, y, each.z
    numbers[:, 3] = speed
    numbers[:, :4] /= LENGTH_SCALE
    numbers[:, 4], numbers[:, 5], numbers[:, 6] = each.age, float(each.own), float(not each.own)
    return rounded(numbers)
